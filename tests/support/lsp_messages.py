"""Messages of the Language Server Protocol as bytes, for tests without an editor."""

import msgspec


def encoded(**params):
    """Return the parameters of a message as they come in."""
    return msgspec.Raw(msgspec.json.encode(params))
