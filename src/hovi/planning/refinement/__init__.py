"""How accurate a solution is, which grid is next, and the certificate."""
