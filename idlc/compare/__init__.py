"""Changes between two versions of interfaces, and the levels that they break."""
