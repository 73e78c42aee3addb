"""Numbers that say what a motion takes: its effort, its extremes."""
