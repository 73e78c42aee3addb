"""What a URDF has to be before Pinocchio reads it."""
