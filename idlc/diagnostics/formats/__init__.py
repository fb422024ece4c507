"""Formats: a report as people and programs read it, a module for each."""
