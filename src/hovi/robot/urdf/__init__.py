"""Checks and normalizes URDFs before Pinocchio reads them."""
