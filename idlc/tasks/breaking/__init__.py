"""`idlc breaking`: against files, recordings and a running graph."""
