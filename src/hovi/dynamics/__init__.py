"""Joint torques tau(q, v, a, t) of a robot and their exact derivatives."""
