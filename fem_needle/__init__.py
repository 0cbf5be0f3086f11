"""Flexible needles in soft tissue: the finite-element reference and the shared tools."""
