"""The way back of a start that is outside its limits, or leaves them: wider bounds for a while."""
