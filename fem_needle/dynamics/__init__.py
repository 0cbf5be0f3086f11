"""A needle in time, compiled: steps and equilibria of any needle whose shapes are polynomials on pieces (numba)."""
