"""The driver: each command's pipeline on one screen, from what was typed to values to print."""
