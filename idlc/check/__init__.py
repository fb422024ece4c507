"""Rules: of interface files, and of the packages that they are in."""
