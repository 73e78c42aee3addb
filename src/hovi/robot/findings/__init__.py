"""What will hurt about a robot's file, one file a kind, each with the line to write."""
