"""Messages of a robot: their types, and subscriptions."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack
from functools import partial
from typing import Any

from msgspec.structs import replace

from idlc.diagnostics import codes
from idlc.diagnostics.report import Report, Severity
from idlc.recordings.containers.file import START, unread_reason
from idlc.recordings.containers.source import RecordingError
from idlc.recordings.load import type_of
from idlc.robot.keys import Entity, EntityKind
from idlc.robot.live.connect import TICK, Inbox, find_endpoints, own_endpoint
from idlc.robot.live.types import definitions
from idlc.robot.qos import QoSProfile, ReliabilityPolicy
from idlc.robot.session import Session
from idlc.robot.transport import unread_bytes

#: Reasons that are printed while messages arrive.
MOST_REASONS = 10
#: The profile for a topic without publishers.
_DEFAULT = QoSProfile(depth=10, reliability=ReliabilityPolicy.BEST_EFFORT)


def subscribe(
    session: Session, ends: Sequence[Entity], inbox: Inbox, number: int, declared: ExitStack
) -> None:
    """Subscribe to one version of a topic as its publishers offer it, until `declared` is closed.

    The subscription is announced, so that publishers that wait for subscriptions begin.
    """
    offered = [end.qos for end in ends if end.kind is EntityKind.PUBLISHER] or [_DEFAULT]
    qos = QoSProfile(
        depth=max(qos.depth for qos in offered),
        # the stricter policy has the lower number
        reliability=min(qos.reliability for qos in offered),
        durability=min(qos.durability for qos in offered),
    )
    own = own_endpoint(session, ends[0], EntityKind.SUBSCRIPTION, qos)
    declared.callback(session.transport.subscriber(own, partial(inbox.put, number)).close)
    declared.callback(session.transport.announce(own).close)


def find_version(
    session: Session,
    name: str,
    kinds: Sequence[EntityKind],
    report: Report,
    include: tuple[str, ...] = (),
) -> tuple[Any, list[Entity]]:
    """Return the class and the endpoints of a topic or service, of the first version on offer.

    Types are also looked up in the folders `include`. Without a type or an endpoint, it reports
    IDL655 or IDL652, and returns `None` and no endpoints.
    """
    ends = find_endpoints(session, [name], kinds, report)
    if not ends:
        return None, []
    first = next(
        (end for end in ends if end.kind in (EntityKind.PUBLISHER, EntityKind.SERVICE)), ends[0]
    )
    chosen = [end for end in ends if (end.type, end.hash) == (first.type, first.hash)]
    version = f"the version of `{first.node_name}`, {first.type} {first.hash}"
    if len(chosen) < len(ends):
        report.notes.append(f"`{first.name}` has several versions; idlc uses {version}")
    (definition,) = definitions(session, "", [first], include=include)
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        try:
            return type_of(definition.topic, include, origin=definition.origin).kind, chosen
        except RecordingError as error:
            message = error.message
            if definition.problem:
                message += f" ({definition.problem})"
            missing = codes.MISSING_DEFINITION.of("", message, hint=error.hint)
            report.add(replace(missing, severity=Severity.ERROR))
            return None, []
        finally:
            report.notes += [str(warning.message) for warning in caught]


def _check_length(
    kind: Any, end: Entity, payload: bytes, complain: Callable[[str], object]
) -> None:
    """Complain if a message is longer than its type."""
    if unread := unread_bytes(payload, kind.deserialize(payload)):
        what = f"a message of `{end.name}` has {unread:,} bytes that {end.type} does not read"
        complain(f"{what}: the publisher has another version of the type")


def messages(
    session: Session,
    ends: Sequence[Entity],
    read: Callable[[bytes], Any],
    count: int | None,
    report: Report,
    complain: Callable[[str], object] = lambda _: None,
    kind: Any = None,
) -> Iterator[Any]:
    """Yield what is read of the messages of a topic as they arrive, until there are `count`.

    Malformed ones count. They and lost ones are noted; `complain` is called at once with each new
    reason why messages are malformed, and if the first one is longer than its `kind`.
    """
    inbox, done, malformed = Inbox(), 0, 0
    reasons = set[str]()
    with ExitStack() as declared:
        subscribe(session, ends, inbox, 0, declared)
        try:
            while count is None or done < count:
                arrival = inbox.get(TICK)
                if arrival is None or arrival.sample is None:
                    continue
                done += 1
                payload = arrival.sample.payload
                try:
                    message = read(payload)
                except ValueError as error:
                    malformed += 1
                    known = unread_reason(ends[0].name, payload[:START])
                    reason = known.message if known else f"a message is malformed: {error}"
                    if reason not in reasons and len(reasons) < MOST_REASONS:
                        reasons.add(reason)
                        complain(reason)
                    continue
                is_first = done - malformed == 1
                if kind is not None and is_first:
                    _check_length(kind, ends[0], payload, complain)
                yield message
        finally:
            for number, adjective in ((malformed, "malformed"), (inbox.lost, "lost")):
                if number:
                    report.notes.append(f"{number} {adjective} messages of `{ends[0].name}`")
