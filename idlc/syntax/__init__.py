"""Syntax: one file's lossless lines, and the literals in them."""
