"""What an editor can ask for: a module for each feature, imported when it is asked."""
