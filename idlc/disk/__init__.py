"""Disk: the only package that touches files, folders and the environment."""
