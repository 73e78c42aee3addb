"""Services that know no robot: files, interrupts, deadlines, threads, dataclasses."""
