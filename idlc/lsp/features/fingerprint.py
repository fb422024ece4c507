"""Whether what an editor shows in a document changed with another document."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator
from sys import maxsize
from zlib import crc32

import msgspec

from idlc.lsp.documents import Document
from idlc.lsp.features.hints import hints
from idlc.lsp.features.lenses import lenses
from idlc.lsp.features.tokens import document as tokens
from idlc.lsp.protocol.parts import DocumentId, OfDocument, OfRange, Position, Range
from idlc.lsp.users import uses
from idlc.lsp.world import World

_WHOLE = Range(Position(0, 0), Position(maxsize, 0))


def fingerprints(world: World, documents: Iterable[Document]) -> Iterator[tuple[Document, int]]:
    """Yield each document with a number for their hints, lenses and tokens."""
    counts = Counter(target for _, _, target in uses(world))
    for one in documents:
        asked = DocumentId(one.uri)
        shown: list[object] = [
            hints(world, OfRange(asked, _WHOLE)),
            tokens(world, OfDocument(asked)),
            lenses(world, OfDocument(asked)),
        ]
        if known := world.known(one.uri):
            model = known.state.model_of(known.interface)
            name = known.interface.name
            has_hash = model and model.distro.has_hashes
            # what the lenses say, without looking through all users for each document
            shown += [model.describer.hash(str(name)) if model and has_hash else "", counts[name]]
        yield one, crc32(msgspec.json.encode(shown))
