"""Interfaces for readers: `idlc docs`, `show`, and schemas for other tools."""
