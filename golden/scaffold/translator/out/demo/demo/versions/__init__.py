"""Versions of interfaces, and rules."""
