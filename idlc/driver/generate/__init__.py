"""`idlc gen`: from interfaces to packages on disk."""
