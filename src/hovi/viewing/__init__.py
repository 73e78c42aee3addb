"""Plots, replay pages and tables of a motion."""
