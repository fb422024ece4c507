"""The Language Server Protocol: its messages, how they are framed, and how it counts places."""
