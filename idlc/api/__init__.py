"""The part of `import idlc` that reads recordings and converts messages."""
