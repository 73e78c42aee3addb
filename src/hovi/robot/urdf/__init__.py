"""Checks and normalizes URDFs, and checks the meshes they name, before Pinocchio reads them."""
