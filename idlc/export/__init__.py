"""Export: an interface in other languages: IDL, JSON Schema, MCAP, an outline for people."""
