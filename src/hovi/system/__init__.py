"""Operating system services: files, interrupts, deadlines, threads."""
