"""What a problem requires of its motions, one kind a file, and what a motion violates of it."""
