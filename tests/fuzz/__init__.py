"""Hostile input: scenes, meshes, tables and command lines that nobody would write."""
