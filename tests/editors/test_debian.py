"""What people see most, in editors of Debian: with the lines of docs/editors.md, if it has some.

`make test EDITORS=no` leaves this file out.
"""

import re

from tests.editors import running, scenario
from tests.support.paths import DOCS, ROOT


def expected(seen):
    """Return what is expected of an editor that may be older than inlay hints."""
    return {
        name: value
        for name, value in scenario.EXPECTED.items()
        if name != "inlay_hint" or name in seen
    }


def test_neovim_of_debian(package):
    """An old one: problems are pushed to it, and the plugin starts the server in another way."""
    seen = running.neovim("/usr/bin/nvim", package)
    assert scenario.normal(seen) == expected(seen)
    assert seen["syntax"] == "rosmsgPrimitive"
    # what is built into the server is a file for an editor without the plugin's documents
    assert "builtin_interfaces/Time stamp" in seen["built_in"]["text"]
    assert seen["update"] is True


def test_neovim_of_debian_renames_a_message(workspace):
    assert running.neovim_renames("/usr/bin/nvim", workspace) == scenario.NEOVIM_RENAMES


def emacs(package):
    """Return what Emacs saw with the lines of the document."""
    text = (DOCS / "editors.md").read_text(encoding="utf-8")
    (lines,) = re.findall(r"^```elisp\n(.*?)^```$", text, re.MULTILINE | re.DOTALL)
    path = package.parent / "lines.el"
    path.write_text(lines.replace("/path/to/idlc", str(ROOT)), encoding="utf-8")
    script = running.HERE / "emacs.el"
    return running.see(package, "/usr/bin/emacs", "--batch", "-l", script, LINES=str(path))


def test_emacs_renames_a_message(workspace):
    seen = emacs(workspace)
    expected = [scenario.RENAMED, scenario.RENAMING, scenario.RENAMED, scenario.EDITED]
    assert seen["renaming"] == expected
    assert str(workspace / "base/msg/Pose.msg") in seen["buffers"]


def test_emacs(package):
    seen = emacs(package)
    assert scenario.normal(seen) == expected(seen)
    assert seen["language"] == "rosmsg-mode"
    assert "builtin_interfaces/Time stamp" in seen["built_in"]
    assert seen["update"] is True
