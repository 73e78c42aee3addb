"""What commands make of their arguments: durations, scenes and files."""
