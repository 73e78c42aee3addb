"""What a motion keeps: its margins to limits and obstacles, and what it violates."""
