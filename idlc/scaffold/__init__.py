"""Scaffolding: what new packages, interfaces and nodes look like, and edits of the user's files."""
