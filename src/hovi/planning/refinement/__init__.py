"""Error estimates, grid refinement to a tolerance, and the certificate of a plan."""
