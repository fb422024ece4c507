"""Size, alignment and the codec's plan: the only place that knows how bytes lie."""
