"""One problem on one grid: from a guess to a `Solution`."""
