"""The execution and the output of each command, after click read its words."""
