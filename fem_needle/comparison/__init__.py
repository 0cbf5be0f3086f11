"""Comparisons of models with a reference."""
