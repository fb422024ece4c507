"""Checks: rules over a linked model."""
