"""The interfaces of my_robot_controller are valid, and their generated code is up to date."""

from pathlib import Path
import subprocess
import sys

import pytest

PACKAGE = Path(__file__).parents[1]
REASON = 'idlc is not installed, so nothing can check the committed classes'
pytest.importorskip('idlc', reason=REASON)


def succeeds(*words: str) -> None:
    """Run idlc in the package; fail with its report if it reports an error."""
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


def test_the_interfaces_are_valid() -> None:
    """`idlc check` reports no errors; `idlc explain CODE` explains a code."""
    succeeds('check', '.')


def test_the_classes_are_current() -> None:
    """The generated code is up to date; if not, run `idlc gen` and commit the result."""
    succeeds('gen', '--check')
