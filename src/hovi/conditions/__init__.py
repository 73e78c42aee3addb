"""Conditions: what is asked of a motion, each a function at instants, in a set."""
