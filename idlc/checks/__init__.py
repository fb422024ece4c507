"""Checks: rules over a linked model and the package around it, all listed in `registry`."""
