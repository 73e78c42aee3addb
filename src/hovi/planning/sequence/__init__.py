"""Sequences: several motions, one after the other, planned as one."""
