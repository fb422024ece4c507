"""Size, alignment and the codec's plan: the only room that knows the layout of bytes."""
