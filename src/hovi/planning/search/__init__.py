"""The search behind `plan`: multi-start, continuation, free duration."""
