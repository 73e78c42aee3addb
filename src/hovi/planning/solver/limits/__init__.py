"""Limits at all times: control points of the motion between bounds."""
