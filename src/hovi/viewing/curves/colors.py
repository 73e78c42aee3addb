"""The colors of curves, everywhere the same."""

COLORS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#333333")
"""The color-blind safe palette of Okabe and Ito."""
