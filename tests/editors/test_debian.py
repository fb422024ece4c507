"""What people see most, in editors of Debian: with the lines of docs/editors.md, if it has some.

`make test EDITORS=no` leaves this file out.
"""

import re

from tests.editors import running, scenario
from tests.support.paths import DOCS


def expected(seen):
    """Return what is expected of an editor that may be older than inlay hints."""
    return {
        name: value
        for name, value in scenario.EXPECTED.items()
        if name != "inlay_hint" or name in seen
    }


def test_neovim_of_debian(package):
    """An old one: problems are pushed to it, and it starts the server in another way."""
    seen = running.neovim("/usr/bin/nvim", package)
    assert scenario.normal(seen) == expected(seen)
    assert seen["syntax"] == "rosmsgPrimitive"
    # what is built into the server is a file for an editor without the plugin's documents
    assert "builtin_interfaces/Time stamp" in seen["built_in"]["text"]
    assert seen["update"] is True


def test_emacs(package, tmp_path):
    text = (DOCS / "editors.md").read_text(encoding="utf-8")
    (lines,) = re.findall(r"^```elisp\n(.*?)^```$", text, re.MULTILINE | re.DOTALL)
    (tmp_path / "lines.el").write_text(lines, encoding="utf-8")
    script = running.HERE / "emacs.el"
    seen = running.see(
        package, "/usr/bin/emacs", "--batch", "-l", script, LINES=str(tmp_path / "lines.el")
    )
    assert scenario.normal(seen) == expected(seen)
    assert seen["language"] == "rosmsg-mode"
    assert "builtin_interfaces/Time stamp" in seen["built_in"]
    assert seen["update"] is True
