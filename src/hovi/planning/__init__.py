"""Boundary value problems: stated, solved, refined, searched, read from a file."""
