"""Sources, problems as values with codes, and the formats in which they are shown."""
