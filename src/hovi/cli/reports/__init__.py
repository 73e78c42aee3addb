"""What a command prints, as text and as JSON."""
