"""Domains of DDS that one test has to itself, on this machine."""

import random
import socket
from collections.abc import Iterator
from contextlib import contextmanager, suppress

#: Other domains use ports that systems give to programs that ask for any.
_DOMAINS = range(1, 101)


@contextmanager
def held_domain() -> Iterator[int]:
    """Yield a domain in which no other test is, while a port stands for it."""
    with socket.socket() as held:
        for domain in random.SystemRandom().sample(_DOMAINS, len(_DOMAINS)):
            with suppress(OSError):
                # the first participant of a program that holds no domain
                with socket.socket(type=socket.SOCK_DGRAM) as probe:
                    probe.bind(("", 7410 + 250 * domain))
                held.bind(("127.0.0.1", 22119 + domain))
                break
        else:
            raise AssertionError("no free domain")
        yield domain
