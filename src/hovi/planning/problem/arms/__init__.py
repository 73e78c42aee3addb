"""Limit sets of arms, as their makers publish them: one TOML file each, with its sources."""
