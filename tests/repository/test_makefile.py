"""The Makefile: documents name targets that exist, and CI runs them or a comment says why not."""

import re
from itertools import takewhile

from tests.support.paths import ROOT

MAKEFILE = (ROOT / "Makefile").read_text(encoding="utf-8")
TARGETS = set(re.findall(r"(?m)^([a-z-]+):", MAKEFILE))
WORKFLOWS = sorted(ROOT.glob(".github/workflows/*.yml"))
DOCUMENTS = sorted(
    path for pattern in ("*.md", ".github/*.md", "docs/**/*.md") for path in ROOT.glob(pattern)
)
#: Targets that CI does not run, and the reasons.
LEFT_OUT = {
    "bench": "needs an idle machine; test_benchmarks.py measures each benchmark once",
    "clean": "removes what the other targets use",
    "costs": "takes long; test_costs.py tries how it divides costs",
    "example": "test_example.py finds a difference, which the target would remove",
    "fuzz": "takes hours; `make test` runs the same tests with fewer inputs",
    "environment": "each target that needs the environment makes it",
    "help": "prints the list of targets",
    "quick": "runs a part of what `make test` runs",
    "mutants": "takes long; test_mutants.py makes one mistake",
    "lock": "selects new versions, which a maintainer reviews",
    "runtime-wheel": "release-check builds the same wheel, and uses it",
    "soak": "takes long; `make test` sends fewer messages",
    "test-vscode": "downloads VS Code; `make vscode` runs the extension's own tests",
}


def named(code: str) -> set[str]:
    """Return the targets that commands of a shell make."""
    calls = re.findall(r"(?:^|(?<=[ '\x22$]))make ([^&|;#`'\n]*)", code, re.MULTILINE)
    return {
        word
        for words in calls
        for word in takewhile(re.compile(r"[a-z][a-z-]*$").match, words.split())
    }


def test_documents_name_targets_that_exist():
    for path in DOCUMENTS:
        text = path.read_text(encoding="utf-8")
        blocks = re.findall(r"(?ms)^ *```(?:sh|console)\n(.*?)^ *```$", text)
        spans = re.findall(r"`([^`\n]+)`", text)
        assert named("\n".join(blocks + spans)) <= TARGETS, path


def test_ci_runs_each_target():
    commands = (ROOT / ".ci/run").read_text(encoding="utf-8")
    run = set(re.findall(r"(?m)^check ([a-z-]+)", commands))
    bare = (ROOT / "tests/repository/bare.sh").read_text(encoding="utf-8")
    run |= named("\n".join(re.findall(r"(?m)^ +inside (.*)", bare)))
    for path in WORKFLOWS:
        text = path.read_text(encoding="utf-8")
        run |= named("\n".join(re.findall(r"(?m)^ *(?:- )?run: (.*)", text)))
        lists = re.findall(r"\btarget: (?:\[(.*)\]|([a-z-]+))", text)
        run |= {target for pair in lists for target in ", ".join(pair).split(", ") if target}
    assert run <= TARGETS
    assert not run & LEFT_OUT.keys()
    assert run | LEFT_OUT.keys() == TARGETS


def test_recipes_name_files_and_modules_that_exist():
    """CI would not notice that one of them moved, if it does not run the target."""
    recipes = re.sub(r"(?m)^#.*\n", "", MAKEFILE) + (ROOT / ".ci/run").read_text(encoding="utf-8")
    paths = re.findall(r"\b(?:tests|maintenance|examples|editors)/[\w./*-]*\w", recipes)
    assert len(paths) > 20
    assert [path for path in paths if not [*ROOT.glob(path)]] == []
    modules = re.findall(r"(?:-m|from) ((?:tests|maintenance|benchmarks)[\w.]*)", recipes)
    assert len(modules) > 5
    files = [ROOT / module.replace(".", "/") for module in modules]
    assert [
        path for path in files if not path.is_dir() and not path.with_suffix(".py").exists()
    ] == []
