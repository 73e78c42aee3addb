"""What is reported before a solve: durations that are too short, torques at ends, likely slips."""
