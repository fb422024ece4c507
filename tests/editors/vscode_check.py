"""What people see most, in a real VS Code that has the built extension: `make test-vscode`.

That installs VS Code in build/vscode, where pictures of it are afterwards.
"""

import os
import shutil
import sys

import pytest

from tests.editors import running, scenario
from tests.support import browser
from tests.support.paths import ROOT

FOLDER = ROOT / "build" / "vscode"
PATIENCE = 1500  # VS Code starts several times


@pytest.mark.timeout(PATIENCE)
def test_vscode(package):
    # VS Code asks a login shell for PATH, which knows nothing of the tests
    workspace = scenario.write(package.parent / "renaming", scenario.RENAMING)
    for one in (package, workspace):
        (one / ".venv").symlink_to(sys.prefix, target_is_directory=True)
    for one in FOLDER.glob("*.png"):
        one.unlink()
    extension = ROOT / "build" / "idlc.vsix"
    script = FOLDER / "see.mjs"
    program = os.environ.get("NODE", "node")
    words = (program, script, package, extension, browser.command(), workspace)
    seen = running.see(package, *words, patience=PATIENCE)
    for one in package.parent.glob("*.png"):
        shutil.copy(one, FOLDER)
    assert {name: one for name, one in seen.items() if "failed" in str(one)} == {}
    assert scenario.normal(seen) == scenario.EXPECTED
    assert "builtin_interfaces/Time stamp" in seen["built_in"]["text"]
    assert "uint32 nanosec" in seen["show"]
    assert seen["lens"]
    assert seen["update"]
    steps = seen["rename_message"]
    assert steps["closed"] == scenario.steps(scenario.RENAMING, scenario.RENAMED)
    assert steps["open"] == scenario.steps(scenario.RENAMED, scenario.RENAMING)
    assert seen["rename_file"] == {"renamed": scenario.RENAMED, "back": scenario.RENAMING}
    assert seen["gen"]
    assert seen["scaffold"]
    assert seen["errors"] == 0
    assert "/there/is/no/idlc does not serve editors" in seen["missing"]
