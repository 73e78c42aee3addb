"""From a URDF, a name or a Pinocchio model to a `Robot`."""
