"""Documents around a replay page: a report of a motion, and the menu of demonstrations."""
