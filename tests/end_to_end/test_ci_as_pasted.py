"""docs/ci.md as one pastes it today: a clone beside one's repository, and what is made of it."""

import json
import re
import subprocess
import sys
from pathlib import Path

import pytest
import yaml

from tests.end_to_end.test_pre_commit import clone, git
from tests.support.files import write
from tests.support.github_runner import Runner, plain_environment
from tests.support.paths import DOCS
from tests.support.sarif_schema import runs_of

pytestmark = pytest.mark.long

CI = (DOCS / "ci.md").read_text(encoding="utf-8")
BIN = Path(sys.executable).parent


def block(after: str, kind: str) -> str:
    """Return the first block of code of a kind after some text of the document."""
    rest = CI[CI.index(after) :]
    return re.findall(rf"(?ms)^```{kind}\n(.*?)^```$", rest)[0]


def shell(script, cwd):
    done = subprocess.run(
        ["sh", "-e", "-c", script],  # noqa: S607
        cwd=cwd,
        env={**plain_environment(), "PATH": f"{BIN}:/usr/bin:/bin", "HOME": str(cwd.parent)},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


@pytest.fixture(scope="module")
def repository(tmp_path_factory):
    """A repository of interfaces beside a clone, after the commands of the first paragraph."""
    home = tmp_path_factory.mktemp("home")
    clone(home)
    folder = home / "team"
    folder.mkdir()
    shell(f"git init -q -b main .\n{block('is not published yet', 'sh')}", folder)
    write(folder / "src/demo/msg/Drive.msg", "float64 speed  # [m/s]\n")
    write(folder / "pyproject.toml", '[tool.idlc]\npaths = ["src/demo"]\nout = "demo"\n')
    git("add", "--all", cwd=folder, home=home)
    git("commit", "--quiet", "--message", "all of it", cwd=folder, home=home)
    return folder


def test_the_wheel_installs(repository, tmp_path):
    (line,) = (line for line in block("## Anywhere", "sh").splitlines() if "pip" in line)
    assert line in CI[CI.index("## GitLab") :]
    shell(f"PIP_NO_DEPS=1 PIP_TARGET={tmp_path / 'there'} {line}", repository)
    assert (tmp_path / "there/idlc/cli/main.py").is_file()


def test_the_workflow_of_github(repository):
    """All four kinds of problems: two as annotations and alerts, breaking ones, layout."""
    workflow = yaml.safe_load(block("## GitHub", "yaml"))
    (job,) = workflow["jobs"].values()
    base = git("rev-parse", "HEAD", cwd=repository, home=repository.parent)
    write(repository / "src/demo/msg/Drive.msg", "float32   speed  # [m/s]\n")
    write(repository / "src/demo/msg/Wide.msg", "wstring text  # wide\n")
    event = repository.parent / "event.json"
    event.write_text(json.dumps({"pull_request": {"base": {"sha": base}}}), encoding="utf-8")
    seen = {}

    def python(given):
        assert given["update-environment"] == "false", "the job's other steps keep their Python"
        return {"python-path": sys.executable}

    def upload(given):
        seen["sarif"] = (repository / given["sarif_file"]).read_text(encoding="utf-8")
        return {}

    foreign = {
        "actions/checkout": lambda _: {},
        "actions/setup-python": python,
        "github/codeql-action/upload-sarif": upload,
    }
    environment = {**plain_environment(), "GITHUB_EVENT_PATH": str(event)}
    ended = Runner(repository, environment, foreign).steps(job["steps"], {}, None)
    assert not ended.ok
    left = {path.name for path in (repository.parent / "runner").iterdir()}
    assert left == {"output"}, "idlc's own environment ends with the step"
    said = ended.printed
    assert "::warning file=src/demo/msg/Wide.msg,line=1" in said, said
    assert "::error file=src/demo/msg/Drive.msg,title=idlc fmt::" in said
    assert "title=IDL507 field-type-changed::" in said
    assert "::error file=demo,title=IDL616 drift::" in said
    codes = [[one["ruleId"] for one in run["results"]] for run in runs_of(seen["sarif"])]
    assert codes == [["IDL421"], ["IDL507"], ["IDL616"]]
    kinds = [run["automationDetails"]["id"] for run in json.loads(seen["sarif"])["runs"]]
    assert kinds == ["idlc/check/", "idlc/breaking/", "idlc/gen/"]
