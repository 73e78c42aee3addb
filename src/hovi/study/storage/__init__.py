"""The files of a study: what workers write as they go, and the tables made of it."""
