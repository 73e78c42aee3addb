"""The optimiser: an objective that evaluates, retracts and has a norm; no robot in sight."""
