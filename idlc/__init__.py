"""idlc: the ROS 2 interface compiler for Python."""

from __future__ import annotations

from idlc.version import __version__

TYPE_CHECKING = False
if TYPE_CHECKING:
    from idlc.api.arrays import to_numpy
    from idlc.api.reader import patch, reader
    from idlc.api.recording import Recording
    from idlc.api.sources import load
    from idlc.api.upgrade import upgrade
    from idlc.recordings.batches import Batch, delimited, split_delimited, split_mcap_chunk

__all__ = [
    "Batch",
    "Recording",
    "__version__",
    "delimited",
    "load",
    "patch",
    "reader",
    "split_delimited",
    "split_mcap_chunk",
    "to_numpy",
    "upgrade",
]

#: What programs use, and the modules that are imported when they ask for it.
_MODULES = {
    "Batch": "recordings.batches",
    "Recording": "api.recording",
    "delimited": "recordings.batches",
    "load": "api.sources",
    "patch": "api.reader",
    "reader": "api.reader",
    "split_delimited": "recordings.batches",
    "split_mcap_chunk": "recordings.batches",
    "to_numpy": "api.arrays",
    "upgrade": "api.upgrade",
}


def __getattr__(name: str) -> object:
    """Import what a program asks for."""
    if name in _MODULES:
        module = __import__(f"idlc.{_MODULES[name]}", fromlist=[name])
        globals()[name] = getattr(module, name)
        return globals()[name]
    raise AttributeError(f"module 'idlc' has no attribute {name!r}")


def __dir__() -> list[str]:
    """Return what there is, for help() and completion."""
    return sorted({*globals(), *__all__})
