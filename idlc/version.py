"""The version of idlc, which a release raises."""

__version__ = "0.2.0"
