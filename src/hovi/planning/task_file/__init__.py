"""Scene files: TOML to a `Task` and back."""
