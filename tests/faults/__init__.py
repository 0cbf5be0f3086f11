"""Faults of disk, memory and processes, and files that are damaged or hostile."""
