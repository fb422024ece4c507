"""Rules on the package around the interfaces, and the facts that they look at."""
