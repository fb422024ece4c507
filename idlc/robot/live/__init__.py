"""A robot that is running: its types, its graph, and its messages, for commands."""
