"""Output: what is written, and how nothing of the user's is lost while it is."""
