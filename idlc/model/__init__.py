"""The meaning of interface files: immutable values, linked by name, hashes and the catalogue."""
