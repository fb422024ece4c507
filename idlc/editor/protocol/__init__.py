"""The language server protocol: messages, positions, URIs, framing."""
