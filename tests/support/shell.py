"""The environment of the tests, which depends on nothing of the user's shell.

`tests/conftest.py` imports this module before idlc, which reads variables where it is imported.
"""

import os
import re
import sys
from pathlib import Path

from tests.support.paths import ROOT

#: The variables that tests and the programs that they start inherit; they inherit no others.
KEPT = re.compile(
    r"PATH|HOME|USER|LOGNAME|SHELL|TMPDIR"  # where programs and files are
    r"|(PIP|UV|NPM)_.*|.*_PROXY|.*_CERTS?(_.*)?|.*_CA_BUNDLE"  # how packages are installed
    r"|_ROS_WHEELS_.*|LD_LIBRARY_PATH|COVERAGE_.*"  # how this process was started
    r"|PYTEST_(XDIST_.*|DEBUG_TEMPROOT)"
    r"|IDLC_(?!DEBUG).*|CYDR_CACHE_DIR|NODE|SEED|TOOLS",  # how `make` and users choose tests
    re.IGNORECASE,
)
#: DDS stays on this machine, logs stay in this folder, and programs write UTF-8.
SET = {
    "LANG": "C.UTF-8",
    "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST",
    "ROS_LOG_DIR": str(ROOT / "build/log"),
}


def _leave() -> None:
    """Remove from this process what the shell set, except what KEPT allows."""
    paths = os.environ.get("PYTHONPATH", "").split(os.pathsep)
    for path in filter(None, paths):
        if (entry := os.path.abspath(path)) in sys.path:  # noqa: PTH100 - as `site` does it
            sys.path.remove(entry)
    for name in [name for name in os.environ if not KEPT.fullmatch(name)]:
        del os.environ[name]
    if str(ROOT) in paths:  # a copy of this repository, whose programs import idlc from it
        os.environ["PYTHONPATH"] = str(ROOT)
        sys.path.insert(0, str(ROOT))
    if "LD_LIBRARY_PATH" in os.environ:  # the ROS 2 wheels add theirs to the shell's
        paths = os.environ["LD_LIBRARY_PATH"].split(os.pathsep)
        prefix = Path(sys.prefix).resolve()
        own = [path for path in paths if prefix in Path(path).resolve().parents]
        os.environ["LD_LIBRARY_PATH"] = os.pathsep.join(own)
    sys.dont_write_bytecode = False  # each process would compile all tests, and idlc
    os.environ.update(SET)
    os.umask(0o022)


# Windows has many variables of its own, and no test of ROS runs there.
if os.name == "posix":
    _leave()
