"""Distances at all times: rows at the instants at which pairs of shapes come near."""
