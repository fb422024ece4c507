"""From syntax trees to interfaces."""
