"""Two versions of a type: the differences, who is broken, the conversion."""
