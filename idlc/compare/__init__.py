"""Changes between two versions of interfaces, and what they break."""
