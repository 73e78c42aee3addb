"""What is left of a motion from a time on, and what a solve keeps of it."""
