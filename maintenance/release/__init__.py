"""What RELEASING.md does by program: prepare a release, and rehearse it as far as one can."""
