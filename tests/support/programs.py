"""Other programs as tests run them: nothing to read, and all that they print in one text."""

import os
import subprocess
from collections.abc import Mapping
from pathlib import Path


def ended(
    *command: object, cwd: Path, environment: Mapping[str, str] | None = None
) -> tuple[int, str]:
    """Return the status of a program and what it printed."""
    done = subprocess.run(
        [str(word) for word in command],
        cwd=cwd,
        env=os.environ if environment is None else environment,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        check=False,
    )
    return done.returncode, done.stdout


def run(*command: object, cwd: Path, environment: Mapping[str, str] | None = None) -> str:
    """Return what a program printed; it must not fail."""
    status, printed = ended(*command, cwd=cwd, environment=environment)
    assert status == 0, f"{command} failed:\n{printed}"
    return printed


def run_with(*command: object, cwd: Path, **variables: str) -> str:
    """Run a program with variables besides those of this process."""
    return run(*command, cwd=cwd, environment={**os.environ, **variables})


def clean_environment() -> dict[str, str]:
    """Return this process's environment without what the ROS 2 wheels set."""
    return {
        name: value
        for name, value in os.environ.items()
        if name != "LD_LIBRARY_PATH" and not name.startswith("_ROS_WHEELS")
    }
