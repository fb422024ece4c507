"""Emit: Python output, from layout plan to rendered files."""
