"""Ways to minimise the action of a problem: one method per file, all with one signature."""
