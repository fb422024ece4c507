"""What CI systems run: hooks, the action's script, the snippets, the pytest plugin."""

import json
import os
import re
import shlex
import subprocess
import sys
from pathlib import Path

import pytest

from tests.support.files import write
from tests.support.paths import DOCS, ROOT
from tests.support.sarif_schema import runs_of
from tests.support.tools import tool

LOOSE = "float64   speed# [m/s]\n"
TIDY = "float64 speed  # [m/s]\n"


@pytest.fixture
def here(tmp_path, monkeypatch):
    """A repository with one package, and an `idlc` and a `python` on PATH that are these."""
    monkeypatch.chdir(tmp_path)
    commands = tmp_path / ".bin"
    commands.mkdir()
    for name, words in (("idlc", f'"{sys.executable}" -m idlc'), ("python", f'"{sys.executable}"')):
        (commands / name).write_text(f'#!/bin/sh\nexec {words} "$@"\n')
        (commands / name).chmod(0o755)
    monkeypatch.setenv("PATH", f"{commands}{os.pathsep}{os.environ['PATH']}")
    monkeypatch.setenv("PYTHONPATH", str(ROOT))
    for name in [name for name in os.environ if name.startswith(("GITHUB_", "IDLC_", "GIT_"))]:
        monkeypatch.delenv(name)
    write("demo/msg/Drive.msg", TIDY)
    return tmp_path


def run(*words, **environment):
    return subprocess.run(
        list(words),
        capture_output=True,
        text=True,
        check=False,
        env={**os.environ, **environment},
    )


def git(*words):
    who = ["-c", "user.name=me", "-c", "user.email=me@example.org"]
    command = [tool("git"), *who, *words]
    return subprocess.run(command, check=True, capture_output=True, text=True).stdout


def hooks():
    text = (ROOT / ".pre-commit-hooks.yaml").read_text(encoding="utf-8")
    for block in text.split("- id: ")[1:]:
        yield block.split("\n")[0], dict(re.findall(r"(?m)^  (\w+): (.*)$", block))


@pytest.mark.parametrize(
    ("hook", "text", "status"),
    [
        ("idlc-check", TIDY, 0),
        ("idlc-check", "flot64 speed\n", 1),
        ("idlc-fmt", TIDY, 0),
        ("idlc-fmt", LOOSE, 0),
        ("idlc-gen-check", TIDY, 0),
        ("idlc-gen-check", "float64 other\n", 1),
        ("idlc-gen", TIDY, 0),
        ("idlc-gen", "float64 other\n", 0),
        ("idlc-gen", "flot64 other\n", 1),
    ],
)
@pytest.mark.usefixtures("here")
def test_each_hook_runs_on_the_files_that_changed(hook, text, status):
    write("pyproject.toml", '[tool.idlc]\npaths = ["demo"]\nout = "out/demo"\n')
    assert run("idlc", "gen").returncode == 0
    write("demo/msg/Drive.msg", text)
    settings = dict(hooks())[hook]
    assert settings["language"] == "python"
    files = ["demo/msg/Drive.msg"]
    assert all(re.search(settings["files"], file) for file in files)
    if settings.get("pass_filenames") == "false":
        files = []
    done = run(*shlex.split(settings["entry"]), *files)
    assert done.returncode == status, done.stdout + done.stderr
    if hook == "idlc-gen" and not status:
        assert run("idlc", "gen", "--check").returncode == 0
    if hook == "idlc-fmt":
        # pre-commit fails a hook that changed files
        assert Path("demo/msg/Drive.msg").read_text() == TIDY


@pytest.fixture
def pull_request(here):
    """The event of a pull request, and the file that says so."""
    git("init", "-q", "-b", "main")
    write(".gitignore", ".bin\n")
    git("add", ".")
    git("commit", "-q", "-m", "base")
    base = git("rev-parse", "HEAD").strip()
    event = {"pull_request": {"title": "$(touch hacked)", "base": {"sha": base}}}
    (here / "event.json").write_text(json.dumps(event))
    return {
        "GITHUB_EVENT_PATH": str(here / "event.json"),
        "GITHUB_OUTPUT": str(here / "output"),
        "GITHUB_ACTION_PATH": str(ROOT),
    }


def act(environment, **inputs):
    """Run the action's script as action.yml does, with its defaults."""
    text = (ROOT / "action.yml").read_text(encoding="utf-8")
    defaults = dict(
        re.findall(r"(?m)^  (\w+):\n    description: .*\n    default: \"?(.*?)\"?$", text)
    )
    passed = re.findall(r"(IDLC_\w+): \$\{\{ inputs\.(\w+) \}\}", text)
    assert len(passed) == 6
    values = {**defaults, **inputs}
    given = {variable: values[name] for variable, name in passed}
    return run("sh", str(ROOT / ".ci/action"), **environment, **given)


@pytest.mark.long
def test_the_action_is_content_with_a_good_pull_request(pull_request, here):
    done = act(pull_request, paths="demo")
    assert (done.returncode, done.stderr) == (0, "1 file already formatted\n")
    token, again, notice = done.stdout.splitlines()
    assert token.removeprefix("::stop-commands") == again[:-2]
    assert notice.startswith("::notice title=idlc breaking::no breaking changes")
    assert [one["results"] for one in runs_of((here / "idlc.sarif").read_text())] == [[], []]
    assert (here / "output").read_text() == "sarif=idlc.sarif\n"


def test_the_action_annotates_what_is_wrong_and_what_breaks(pull_request, here):
    write("demo/msg/Drive.msg", "float32   speed  # [m/s]\n")
    write("demo/msg/Wide.msg", "wstring text\n")
    done = act(pull_request, paths="demo")
    assert done.returncode == 1
    assert "::warning file=demo/msg/Wide.msg,line=1" in done.stdout
    assert "+float32 speed" in done.stdout
    assert "::error file=demo/msg/Drive.msg,title=idlc fmt::the layout is not" in done.stdout
    assert "::error file=demo/msg/Drive.msg,line=1,endLine=1,col=1" in done.stdout
    assert "title=IDL507 field-type-changed::field `speed`" in done.stdout
    annotation = next(line for line in done.stdout.splitlines() if "IDL507" in line)
    assert "%0Abreaks: wire, hash" in annotation
    assert "::notice title=idlc breaking::1 breaking change (1 wire, 1 hash" in done.stdout
    check, breaking = runs_of((here / "idlc.sarif").read_text())
    assert [one["ruleId"] for one in check["results"]] == ["IDL421"]
    assert [one["ruleId"] for one in breaking["results"]] == ["IDL507"]
    assert "breaks: wire, hash" in breaking["results"][0]["message"]["text"]
    # code scanning refuses two runs that it cannot keep apart
    assert [run["automationDetails"]["id"] for run in (check, breaking)] == [
        "idlc/check/",
        "idlc/breaking/",
    ]


@pytest.mark.long
def test_the_action_checks_generated_code_where_there_is_any(pull_request):
    write("pyproject.toml", '[tool.idlc]\npaths = ["demo"]\nout = "out/demo"\n')
    done = act(pull_request, paths="demo", breaking="false")
    assert done.returncode == 1
    assert "title=IDL616 drift::" in done.stdout
    assert act(pull_request, paths="demo", breaking="false", generated="false").returncode == 0
    assert run("idlc", "gen").returncode == 0
    assert act(pull_request, paths="demo", breaking="false").returncode == 0
    Path("pyproject.toml").unlink()
    assert act(pull_request, paths="demo", breaking="false", generated="true").returncode == 2


@pytest.mark.long
def test_what_files_say_is_no_command_of_githubs(pull_request):
    """GitHub takes lines that begin with two colons for commands, blanks before them or not."""
    write("demo/msg/Drive.msg", "# ::error::mine\n::error::mine\n  ::error::mine\nint8   a\n")
    done = act(pull_request, paths="demo")
    heard = True
    for line in done.stdout.splitlines():
        if line.startswith("::stop-commands::"):
            heard, token = False, line.removeprefix("::stop-commands::")
        elif not heard and line == f"::{token}::":
            heard = True
        elif heard and line.strip().startswith("::error"):
            assert line.startswith(
                ("::error file=demo/msg/Drive.msg,", "::error file=demo,title=IDL520")
            )
    assert heard


@pytest.mark.long
def test_no_file_of_a_pull_request_is_imported_or_written_through(pull_request, here):
    for name in sorted(sys.stdlib_module_names - {"runpy", "importlib", "pkgutil"}):
        write(f"{name}.py", f"open({str(here / 'ran')!r}, 'a').write('{name} ')\n")
    write("kept", "as it was")
    (here / "idlc.sarif").symlink_to(here / "kept")
    done = act(pull_request, paths="demo")
    assert done.returncode == 0, done.stdout + done.stderr
    assert not (here / "ran").exists()
    assert (here / "kept").read_text() == "as it was"
    assert len(runs_of((here / "idlc.sarif").read_text())) == 2
    script = (ROOT / ".ci/action").read_text(encoding="utf-8")
    starts = re.findall(r'(?m)^(?!#).*?(?:\bpython3?|\$IDLC_PYTHON"?) +(\S+) ', script)
    assert len(starts) == 6
    assert set(starts) == {"-I"}


@pytest.mark.long
def test_the_actions_inputs(pull_request):
    write("demo/msg/Drive.msg", "float32   speed  # [m/s]\n")
    off = {"format": "false", "breaking": "false"}
    assert act(pull_request, paths="demo", **off).returncode == 0
    write("demo/msg/Wide.msg", "wstring text\n")
    assert act(pull_request, paths="demo", **off).returncode == 0
    assert act(pull_request, paths="demo", strict="true", **off).returncode == 1


@pytest.mark.long
def test_no_text_of_a_pull_request_becomes_a_command(pull_request, here):
    for paths in ("$(touch hacked)", "; touch hacked", "--help", "* `touch hacked`"):
        act(pull_request, paths=paths)
    assert not (here / "hacked").exists()
    action = (ROOT / "action.yml").read_text(encoding="utf-8")
    scripts = re.findall(r"(?m)^ +run: (.*)$", action)
    assert len(scripts) == 1
    assert not any("${{" in script for script in scripts)


@pytest.mark.parametrize(("text", "status"), [(TIDY, 0), ("flot64 a\n", 1)])
def test_the_gitlab_snippet(here, text, status):
    write("pyproject.toml", '[tool.idlc]\npaths = ["demo"]\nout = "out/demo"\n')
    assert run("idlc", "gen").returncode == 0
    write("demo/msg/Drive.msg", text)
    document = (DOCS / "ci.md").read_text(encoding="utf-8")
    script = document.partition("  script:\n")[2].partition("  artifacts:")[0]
    # as YAML reads it: a line that goes on is joined to the one before
    lines = script.removeprefix("    - ").replace("\n      ", " ").split("\n    - ")
    assert lines.pop(0).startswith("pip install ")
    git("init", "-q")
    git("add", "demo")
    git("commit", "-q", "-m", "base")
    for base in ("", git("rev-parse", "HEAD").strip()):
        words = ("sh", "-c", "set -e\n" + "\n".join(lines))
        assert run(*words, CI_MERGE_REQUEST_DIFF_BASE_SHA=base).returncode == status
    codes = [
        each["check_name"]
        for each in json.loads((here / "gl-code-quality-report.json").read_text())
    ]
    assert codes == (["IDL201", "IDL460"] if status else [])
    assert f'failures="{status}"' in (here / "idlc.xunit.xml").read_text()


def run_pytest(*words):
    # an installed idlc brings the plugin itself, and it can be there only once
    plugin = ["-p", "idlc.cli.pytest_plugin", "-p", "no:cacheprovider"]
    words = ("-q", "-c", "/dev/null", *words)
    return run(sys.executable, "-m", "pytest", *plugin, *words, PYTEST_DISABLE_PLUGIN_AUTOLOAD="1")


@pytest.mark.usefixtures("here")
def test_the_pytest_plugin():
    write("demo/msg/Wrong.msg", "flot64 a\n")
    write("demo/srv/Wide.srv", "wstring a\n---\n")
    assert run_pytest("demo").returncode == 5, "collected without being asked"
    done = run_pytest("--idlc", "demo")
    assert done.returncode == 1
    assert "1 failed, 2 passed, 1 warning" in done.stdout
    assert "error[IDL201]: unknown type `flot64`" in done.stdout
    assert "IDL421: the encoding of a wstring" in done.stdout
    assert "Traceback" not in done.stdout
    assert "2 failed, 1 passed" in run_pytest("--idlc-strict", "demo").stdout
