"""Convergence studies: errors, orders, extrapolation, pictures."""
