"""The optimiser: for any objective that evaluates, retracts and has a norm."""
