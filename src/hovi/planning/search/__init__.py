"""Many starts, continuation, free duration: everything behind `plan`."""
