"""Runs in legs: all steps between two landings at once, in arrays, with their works and samples."""
