"""What people see most, in editors of Debian: with the lines of docs/editors.md, if it has some.

`make test EDITORS=no` leaves this file out.
"""

import re
import shutil

from tests.editors import running, scenario
from tests.support.paths import DOCS, ROOT
from tests.support.programs import run


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


TEXT = """\
pkg/Type[<=3] field  # a [m/s] unit
uint8 LIMIT=3
string text "it" # isn't
string NAME=isn't
---
@optional float64 x -1.5e3
"""
FACES = [
    ["pkg/Type", "font-lock-type-face"],
    ["field", "font-lock-variable-name-face"],
    ["# ", "font-lock-comment-delimiter-face"],
    ["a ", "font-lock-comment-face"],
    ["[m/s]", "font-lock-constant-face"],
    [" unit\n", "font-lock-comment-face"],
    ["uint8", "font-lock-type-face"],
    ["LIMIT", "font-lock-constant-face"],
    ["string", "font-lock-type-face"],
    ["text", "font-lock-variable-name-face"],
    ['"it"', "font-lock-string-face"],
    ["# ", "font-lock-comment-delimiter-face"],
    ["isn't\n", "font-lock-comment-face"],
    ["string", "font-lock-type-face"],
    ["NAME", "font-lock-constant-face"],
    ["---", "font-lock-preprocessor-face"],
    ["@optional", "font-lock-keyword-face"],
    ["float64", "font-lock-type-face"],
    ["x", "font-lock-variable-name-face"],
]
LINT = """\
(setq byte-compile-error-on-warn t)
(unless (byte-compile-file "rosmsg-mode.el") (kill-emacs 1))
(checkdoc-file "rosmsg-mode.el")
"""


def test_emacs_has_no_warnings(tmp_path):
    """Package archives ask for both."""
    shutil.copy(ROOT / "editors/emacs/rosmsg-mode.el", tmp_path)
    (tmp_path / "lint.el").write_text(LINT, encoding="utf-8")
    output = run("/usr/bin/emacs", "--batch", "-l", "lint.el", cwd=tmp_path)
    assert [line for line in output.splitlines() if not line.startswith("Loading ")] == []


def emacs(package):
    """Return what Emacs saw with the lines of the document."""
    text = (DOCS / "editors.md").read_text(encoding="utf-8")
    (lines,) = re.findall(r"^```elisp\n(.*?)^```$", text, re.MULTILINE | re.DOTALL)
    path = package.parent / "lines.el"
    path.write_text(lines.replace("/path/to/idlc", str(ROOT)), encoding="utf-8")
    script = running.HERE / "emacs.el"
    return running.see(
        package, "/usr/bin/emacs", "--batch", "-l", script, LINES=str(path), TEXT=TEXT
    )


def test_emacs_renames_a_message(workspace):
    seen = emacs(workspace)
    expected = [scenario.RENAMED, scenario.RENAMING, scenario.RENAMED, scenario.EDITED]
    assert seen["renaming"] == expected
    assert str(workspace / "base/msg/Pose.msg") in seen["buffers"]


def test_emacs(package):
    seen = emacs(package)
    assert scenario.normal(seen) == expected(seen)
    assert seen["language"] == "rosmsg-mode"
    assert seen["faces"] == FACES
    assert "builtin_interfaces/Time stamp" in seen["built_in"]
    assert seen["update"] is True
