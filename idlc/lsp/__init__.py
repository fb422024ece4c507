"""The language server: what editors ask about interface files, over JSON-RPC."""
