"""The commands: one thin module each, imported on use."""
