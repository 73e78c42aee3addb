"""The duration as one more unknown of a motion: one solve instead of a search around solves."""
