"""An example of `idlc docs`: the standard interfaces that are installed here, or built in."""

from __future__ import annotations

import sys
from contextlib import redirect_stdout
from io import StringIO
from pathlib import Path

from idlc.cli.main import main

PLACE = "interfaces"
PACKAGES = """
    actionlib_msgs diagnostic_msgs geometry_msgs nav_msgs sensor_msgs shape_msgs std_msgs std_srvs
    stereo_msgs trajectory_msgs visualization_msgs
""".split()


def write(folder: Path) -> None:
    """Write the pages of all packages of common_interfaces into `folder`."""
    share = Path(sys.prefix) / "share"
    installed = {name for name in PACKAGES if (share / name / "package.xml").is_file()}
    words = [str(share / name) if name in installed else name for name in PACKAGES]
    with redirect_stdout(StringIO()):  # it tells of a folder that is temporary
        failed = main(["docs", *words, "-o", str(folder)])
    if failed:
        raise SystemExit("idlc docs failed, see above")
