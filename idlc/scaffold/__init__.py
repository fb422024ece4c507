"""New packages, interfaces and nodes, and their entries in the user's files."""
