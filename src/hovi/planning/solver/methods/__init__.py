"""Methods that minimise the action of a problem, one per file, with a common interface."""
