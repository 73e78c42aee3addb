"""What comes out of a motion: samples at any time, and files for other programs."""
