"""What programs get from `import idlc` to read recordings and convert messages."""
