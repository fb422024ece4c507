"""Nodes and interfaces of demo."""
