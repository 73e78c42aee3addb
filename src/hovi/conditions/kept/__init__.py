"""What people ask a motion to keep all along, one file each: an axis, a line, a plane, a speed."""
