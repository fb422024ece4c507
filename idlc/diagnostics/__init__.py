"""Text: what a file is and how a problem in it is shown."""
