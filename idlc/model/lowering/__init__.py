"""Lowering: from the syntax of one file to its meaning, without looking at any other file."""
