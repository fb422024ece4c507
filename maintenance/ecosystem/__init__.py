"""idlc on clones of public repositories."""
