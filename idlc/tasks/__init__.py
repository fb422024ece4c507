"""What each command does, without its words and its printing."""
