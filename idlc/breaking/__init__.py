"""Changes: what differs between two versions of a package, and for whom that breaks something."""
