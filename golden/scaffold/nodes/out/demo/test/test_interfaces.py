"""The interfaces of demo are valid, and what idlc made of them is current."""

from pathlib import Path
import subprocess
import sys

import pytest

PACKAGE = Path(__file__).parents[1]
REASON = 'idlc is not installed: the classes are used as they were committed'
pytest.importorskip('idlc', reason=REASON)


def succeeds(*words: str) -> None:
    """Run idlc in the package; fail with its report if it finds anything wrong."""
    done = subprocess.run(
        [sys.executable, '-m', 'idlc', *words],
        cwd=PACKAGE,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        check=False,
    )
    if done.returncode != 0:
        pytest.fail(f'idlc {" ".join(words)}\n{done.stdout}', pytrace=False)


@pytest.mark.linter
def test_the_interfaces_are_valid() -> None:
    """`idlc check` finds no error; `idlc explain` knows every code that it names."""
    succeeds('check', '.')


@pytest.mark.linter
def test_the_classes_are_current() -> None:
    """`idlc gen` would write what is there; if not, run it and commit what it writes."""
    succeeds('gen', '--check')
