"""The tests depend on nothing of the user's shell."""

import os
import re
import subprocess
import sys

from tests.support.paths import ROOT
from tests.support.shell import KEPT

#: What a shell may set.
HOSTILE = {
    "AMENT_PREFIX_PATH": "/nonexistent",
    "COLUMNS": "40",
    "FORCE_COLOR": "1",
    "GIT_DIR": "/nonexistent",
    "LC_ALL": "C",
    "PYTHONPATH": "/nonexistent",
    "RMW_IMPLEMENTATION": "rmw_nonsense",
    "ROS_DISTRO": "nonsense",
    "ROS_DOMAIN_ID": "77",
    "ZENOH_SESSION_CONFIG_URI": "/nonexistent",
}
#: Without tests/support/shell.py, each fails for one of these.
TESTS = (
    "tests/cli/test_check.py::test_a_diff_shows_what_fix_would_write_and_writes_nothing",
    "tests/tasks/test_places.py::test_what_was_removed_is_shown_where_it_was",
    "tests/robot/test_node_programs.py::test_two_programs_meet_at_a_router",
)


def test_a_hostile_shell_changes_no_result(tmp_path):
    folder = tmp_path / "with a space"
    folder.mkdir()
    command = [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", *TESTS]
    done = subprocess.run(
        command,
        cwd=ROOT,
        env={**os.environ, **HOSTILE, "TMPDIR": str(folder)},
        umask=0o077,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stdout + done.stderr


def test_variables_that_tests_read_are_kept():
    read = re.compile(r'environ(?:\.get\("(\w+)"|\["(\w+)"\](?! =))|"(\w+)" in os\.environ')
    names = {
        name
        for path in (ROOT / "tests").rglob("*.py")
        if path.name != "shell.py" and "programs" not in path.parts  # tests start these
        for names in read.findall(path.read_text(encoding="utf-8"))
        for name in filter(None, names)
    }
    assert "IDLC_ROUNDS" in names
    assert [name for name in sorted(names) if not KEPT.fullmatch(name)] == []
