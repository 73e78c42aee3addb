"""Worker processes: a pool that keeps what was done when one of them dies."""
