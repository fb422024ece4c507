"""`idlc gen --watch`: run again after every change, until Ctrl-C."""

from __future__ import annotations

import sys
import time

from idlc.cli.gen_run import once
from idlc.diagnostics.visible import one_line
from idlc.disk.watch import Stamp, snapshot, stamps
from idlc.driver.generate.gen import GenOptions
from idlc.recordings.find import files

INTERVAL = 0.25


def run_again(wanted: GenOptions, style: str) -> int:
    """Run now and after each change of what is compiled; Ctrl-C ends it with status 0."""
    try:
        seen = _snapshot(wanted)
        once(wanted, style)
        sys.stderr.write(f"watching {one_line(', '.join(wanted.paths))}; Ctrl-C ends\n")
        while True:
            sys.stdout.flush()
            sys.stderr.flush()
            time.sleep(INTERVAL)
            now = _snapshot(wanted)
            if now == seen:
                continue
            while (later := _after(wanted)) != now:
                now = later
            seen = now
            once(wanted, style)
    except KeyboardInterrupt:
        sys.stderr.write("\n")
        return 0


def _after(wanted: GenOptions) -> dict[str, Stamp]:
    """Return a snapshot from a moment later, so that a burst of changes counts as one."""
    time.sleep(INTERVAL)
    return _snapshot(wanted)


def _snapshot(wanted: GenOptions) -> dict[str, Stamp]:
    return snapshot(wanted.paths, wanted.scope.include) | stamps(files(wanted.paths))
