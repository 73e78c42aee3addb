"""The notation of ends, via points and durations that scene files and Python share."""
