"""`idlc breaking`: versions, distributions, the nodes of a graph."""
