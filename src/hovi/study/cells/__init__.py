"""The cells of a study: a scene file as template, and the values that each cell puts into it."""
