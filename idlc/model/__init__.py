"""What interface files mean: immutable values, linked by name, with hashes and the catalogue."""
