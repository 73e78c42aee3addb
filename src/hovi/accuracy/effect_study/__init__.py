"""The influence of single effects on a motion, and their computing time."""
