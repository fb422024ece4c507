"""Files on disk: package.xml, settings, prefixes, git, idlc.lock and the one writer."""
