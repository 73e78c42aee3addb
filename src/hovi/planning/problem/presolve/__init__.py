"""What is told before a solve: durations that are too short, torques at ends, likely slips."""
