"""`idlc scaffold`: new packages, interfaces and nodes."""
