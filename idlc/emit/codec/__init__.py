"""The codec: from a structure to the Python statements that write and read it."""
