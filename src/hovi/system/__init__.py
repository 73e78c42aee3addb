"""What the package asks of the operating system: files, signals, deadlines, threads."""
