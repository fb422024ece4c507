"""Which files make a package, what it is called and what is around it."""
