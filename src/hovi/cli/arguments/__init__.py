"""Parsing and checks of command-line arguments: durations, scenes and files."""
