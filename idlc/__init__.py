"""idlc: the ROS 2 interface compiler for Python."""

from __future__ import annotations

from idlc.version import __version__

TYPE_CHECKING = False
if TYPE_CHECKING:
    from idlc.recordings.load import load
    from idlc.recordings.recording import Recording

__all__ = ["Recording", "__version__", "load"]


def __getattr__(name: str) -> object:
    """Import what programs use when they ask for it."""
    if name == "Recording":
        from idlc.recordings.recording import Recording

        return Recording
    if name == "load":
        from idlc.recordings.load import load

        return load
    raise AttributeError(f"module 'idlc' has no attribute {name!r}")


def __dir__() -> list[str]:
    """Return what there is, for help() and completion."""
    return sorted({*globals(), *__all__})
