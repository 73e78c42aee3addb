"""Why a minimum of the discrete action is none between the quadrature points."""
