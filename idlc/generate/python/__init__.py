"""Models as Python source: classes, fields and codecs."""
