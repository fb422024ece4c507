"""The graph of a domain: its nodes and endpoints, as a transport shows them."""

from __future__ import annotations

import time
from collections.abc import Callable
from itertools import islice
from threading import Condition
from typing import Any, TypeVar

from idlc.robot.keys import Entity, EntityKind
from idlc.robot.transport import Transport

#: The memory of a graph's entities, about so much for each and for each character of its token.
#: It is enough for 100,000 endpoints.
MOST_BYTES = 128 * 2**20
ENTITY_BYTES = 500
CHARACTER_BYTES = 4
#: Seconds for the answers to a question; after ten, a router ends them as if they were all.
_TIMEOUT = 9.0
#: Seconds until a graph asks again for entities that exist and have not arrived, and the times.
_SETTLED = 1.0
_TIMES = 15
#: Seconds after which a graph does not ask again.
_PATIENCE = 60.0
#: Stands for the tokens that are missing in an answer, and never arrives.
_UNKNOWN = ""
T = TypeVar("T")


class Graph:
    """The entities of a domain, with those of the own session.

    An endpoint can appear before its node and outlive it. Methods can be called on any thread.
    Entities are missing if `is_full`, because there were too many, or `is_incomplete`, because
    some arrived too late.
    """

    def __init__(self, transport: Transport, domain: int, limit: int = MOST_BYTES) -> None:
        self.is_full = False
        self._limit = limit
        self._bytes = 0
        self._entities: dict[str, Entity] = {}
        self._named: dict[tuple[EntityKind | None, str | None], dict[str, Entity]] = {}
        self._changed = Condition()
        #: Conditions to trigger after each change.
        self.watchers: set[Any] = set()
        end = time.monotonic() + _PATIENCE
        # Zenoh may answer with nothing after the watch; what goes in between never arrives
        self._expected, known = self._ask(transport, domain), 0
        while _UNKNOWN in self._expected and known < len(self._expected) and time.monotonic() < end:
            known = len(self._expected)
            self._expected = self._ask(transport, domain)
        self._watch = transport.watch(domain, self._update)
        for _ in range(_TIMES):
            known = len(self._entities)
            if self.wait_for(Graph._has_expected, _SETTLED):
                break
            answer = self._ask(transport, domain)
            self._expected = answer or self._expected
            is_over = time.monotonic() > end
            if is_over or (_UNKNOWN in answer and len(self._entities) == known):
                break
        self.is_incomplete = not self._has_expected()
        self._expected.clear()

    def _ask(self, transport: Transport, domain: int) -> set[str]:
        """Return the tokens of the entities that exist, so many as have room."""
        tokens: set[str] = set()
        entities = islice(transport.entities(domain, _TIMEOUT), self._limit // ENTITY_BYTES)
        try:
            tokens.update(entity.token for entity in entities)
        except TimeoutError:
            tokens.add(_UNKNOWN)
        return tokens

    def _has_expected(self) -> bool:
        return self.is_full or self._expected <= self._entities.keys()

    def close(self) -> None:
        """Stop watching; the entities stay as they are."""
        self._watch.close()

    def entities(
        self, kind: EntityKind | None = None, name: str | None = None
    ) -> tuple[Entity, ...]:
        """Return the entities of this kind; with a kind and an absolute name, those of both."""
        with self._changed:
            known = self._entities if name is None else self._named.get((kind, name), {})
            return tuple(entity for entity in known.values() if kind in (None, entity.kind))

    def count(self, kind: EntityKind, name: str) -> int:
        """Return the number of publishers, say, of the topic with this absolute name."""
        with self._changed:
            return len(self._named.get((kind, name), ()))

    def types(self, *kinds: EntityKind) -> dict[str, tuple[str, ...]]:
        """Return the types of each topic or service, by its absolute name, sorted."""
        types: dict[str, set[str]] = {}
        for kind in kinds:
            for entity in self.entities(kind):
                types.setdefault(entity.name, set()).add(entity.type)
        return {name: tuple(sorted(types[name])) for name in sorted(types)}

    def wait_for(self, condition: Callable[[Graph], T], timeout: float | None) -> T:
        """Return the first true result of `condition`, or its last result after `timeout` seconds.

        The condition is called again after each change of the graph.
        """
        with self._changed:
            return self._changed.wait_for(lambda: condition(self), timeout)

    def _update(self, entity: Entity, appears: bool) -> None:
        """Add an entity if it is new and has room, or remove it."""
        token = entity.token
        size = ENTITY_BYTES + CHARACTER_BYTES * len(token)
        with self._changed:
            if appears == (token in self._entities):
                return
            if appears and self._bytes + size > self._limit:
                self.is_full = True
                return
            same = self._named.setdefault((entity.kind, entity.name), {})
            if appears:
                self._bytes += size
                self._entities[token] = same[token] = entity
            else:
                self._bytes -= size
                del self._entities[token], same[token]
                if not same:
                    del self._named[entity.kind, entity.name]
            self._changed.notify_all()
        for watcher in [*self.watchers]:
            watcher.trigger()
