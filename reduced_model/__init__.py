"""Assumed-mode models of a needle in soft tissue."""
