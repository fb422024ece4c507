"""Writing packages: Python classes with codecs, libraries for C++ tools, prefixes."""
