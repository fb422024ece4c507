"""`idlc docs`: pages about packages."""
