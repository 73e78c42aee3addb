"""The command `hovi`."""
