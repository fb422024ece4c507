"""The automated steps of RELEASING.md: prepare a release, and rehearse it."""
