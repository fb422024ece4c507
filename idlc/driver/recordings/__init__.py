"""Recordings: as a source of interfaces, and their messages as columns."""
