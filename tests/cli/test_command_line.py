"""The command line as people and programs meet it: in its own process, from outside."""

import gc
import json
import os
import re
import shlex
import shutil
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from idlc.cli.app import COMMANDS
from idlc.cli.main import main
from idlc.cli.options import DOCUMENTS
from idlc.diagnostics import codes
from idlc.version import __version__
from tests.support import recordings
from tests.support.files import write
from tests.support.paths import ROOT
from tests.support.waiting import read_line, wait_for
from tests.tasks.test_lerobot import simple

MSG = "float64 speed\n"


pytestmark = pytest.mark.usefixtures("here")


def make(path: str, text: str = MSG) -> None:
    write(path, text)


def idlc(*words: str, **options) -> subprocess.CompletedProcess:
    options.setdefault("env", {**os.environ, "PYTHONUTF8": "1"})
    done = subprocess.run(
        [sys.executable, "-m", "idlc", *words],
        capture_output=True,
        text=True,
        check=False,
        **options,
    )
    assert "Traceback" not in done.stderr
    return done


def stamps(folder: str) -> dict[str, int]:
    return {str(path): path.stat().st_mtime_ns for path in Path(folder).rglob("*.py")}


def test_no_thread_of_zenoh_delays_the_end(monkeypatch, capsys):
    statuses = []
    monkeypatch.setattr(sys, "argv", ["idlc", "--version"])
    monkeypatch.setattr("os._exit", statuses.append)
    monkeypatch.delitem(sys.modules, "zenoh", raising=False)
    for loaded in (False, True):
        if loaded:
            monkeypatch.setitem(sys.modules, "zenoh", sys)
        assert main() == 0
        gc.unfreeze()
        assert statuses == [0] * loaded
    assert capsys.readouterr().out == f"idlc {__version__}\n" * 2


@pytest.mark.parametrize("option", ["--version", "-V"])
def test_the_version(option):
    assert idlc(option).stdout == f"idlc {__version__}\n"


def imported(words: list[str]) -> set[str]:
    """Return the top-level modules that a command imports."""
    code = (
        "import sys\nfrom idlc.cli.main import main\n"
        f"status = main({words!r})\n"
        "print('\\n' + ' '.join({name.partition('.')[0] for name in sys.modules}))\n"
        "sys.exit(status)\n"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    return set(done.stdout.splitlines()[-1].split())


@pytest.mark.parametrize("command", COMMANDS)
def test_help_imports_nothing_heavy(command):
    heavy = {"jinja2", "lark", "msgspec", "numpy", "rich"}
    assert not heavy & imported([command, "--help"])


def test_a_run_with_nothing_to_do_imports_no_compiler():
    make("pkg/msg/A.msg")
    words = ["gen", "pkg", "-o", "out/demo"]
    assert "jinja2" in imported(words)
    assert not {"lark", "jinja2", "numpy", "rich"} & imported(words)


@pytest.mark.parametrize("command", ["", *COMMANDS])
def test_the_example_in_each_help_works_as_pasted(command, capfd):
    assert main([command, "--help"] if command else ["--help"]) == 0
    text = capfd.readouterr().out
    if " rec.mcap" in text:  # this cannot be pasted
        recordings.by_mcap(Path("rec.mcap"), recordings.messages(6))
        recordings.by_mcap(Path("ep_1.mcap"), simple())
    example = text.partition("Example:\n\n")[2].partition("\n\n  ")[0]
    lines = [line.strip() for line in example.splitlines() if line.startswith("    ")]
    assert any(line.startswith("idlc ") for line in lines), text
    if lines == ["idlc router"] or "tcp/robot:7447" in example:
        return  # it needs Ctrl-C or a robot: tests/robot/test_live.py has both
    script = f"set -e\nidlc() {{ '{sys.executable}' -m idlc \"$@\"; }}\n" + "\n".join(lines)
    # `idlc columns` without `-o` writes bytes to a pipe
    done = subprocess.run(["/bin/sh", "-c", script], capture_output=True, check=False)
    assert done.returncode == 0, done.stderr
    assert done.stdout


@pytest.mark.parametrize(
    ("words", "status"),
    [
        ("check good", 0),
        ("check bad", 1),
        ("check good/msg/A.msg bad", 1),
        ("check missing", 2),
        ("check missing bad", 2),
        ("check empty", 2),
        ("check --no-such-option", 2),
        ("chekc", 2),
        ("gen good -o out/demo", 0),
        ("gen warned -o out/demo", 0),
        ("gen bad -o out/demo", 1),
        ("gen good", 2),
        ("gen", 2),
        ("gen empty -o out", 2),
        ("gen good -o good/msg/A.msg", 2),
        ("gen good -o /proc/none/demo", 2),
        ("gen good -o out/1abc", 2),
        ("gen good -o out/demo --package class", 2),
        ("gen good -o out/demo --check", 1),
        ("gen good -o out/demo --check --force", 2),
        ("show good std_msgs/msg/Header --format hash", 0),
        ("show bad --format hash", 1),
        ("show std_msgs/msg/Nope --format hash", 2),
        ("show", 2),
        ("show std_srvs/srv/SetBool_Request --format type-description", 0),
        ("show good/msg/A.msg --package good --format type-description", 0),
        ("show nope --format type-description", 2),
        ("explain IDL201", 0),
        ("explain idl201", 0),
        ("explain unknown-type", 0),
        ("explain", 0),
        ("help", 0),
        ("explain IDL999", 2),
        ("--help", 0),
    ],
)
def test_exit_statuses(words, status, capfd):
    make("good/msg/A.msg")
    make("bad/msg/A.msg", "flot64 speed\n")
    make("warned/msg/A.msg", "float64 class\n")
    make("empty/README.md")
    assert main(words.split()) == status
    assert "Traceback" not in capfd.readouterr().err


def test_an_unknown_code_or_command_gets_a_suggestion(capsys):
    for words, hint in (
        (["explain", "IDL2O1"], "did you mean IDL201?"),
        (["explain", "wide-strin"], "did you mean wide-string?"),
        (["explain", "nonsense"], "`idlc explain` lists the codes"),
        (["chekc"], "did you mean `check`?"),
        (["generate"], "did you mean `gen`?"),
        (["new"], "did you mean `scaffold`?"),
        (["help", "lint"], "did you mean `check`?"),
        (["xyzzy"], "the commands are init, gen, check"),
        (["scaffold", "pkg"], "did you mean `package`?"),
        (["scaffold", "xyzzy"], "the commands are package, interface, node"),
    ):
        assert main(words) == 2
        assert hint in capsys.readouterr().err


def test_help_is_a_command_too(capsys):
    for words in ([], ["gen"], ["scaffold"], ["scaffold", "node"]):
        assert main([*words, "--help"]) == 0
        expected = capsys.readouterr().out
        assert main(["help", *words]) == 0
        assert capsys.readouterr().out == expected


def test_codes_go_by_id_and_name(capsys):
    assert main(["explain", "IDL422"]) == 0
    expected = capsys.readouterr().out
    for word in ("char-type", "CHAR_TYPE", "idl422", "422"):
        assert main(["explain", word]) == 0
        assert capsys.readouterr().out == expected
    assert main(["explain"]) == 0
    listed = capsys.readouterr().out
    assert all(f"  {one.id}  {one.slug} " in listed for one in codes.CODES.values())
    assert re.search(r"(?m)^Style\n  IDL401 ", listed)


def test_what_is_compiled_again_and_what_is_not():
    make("pkg/msg/A.msg", "dep_msgs/B b\n")
    make("src/dep_msgs/msg/B.msg")
    words = ["gen", "pkg", "-o", "out/demo", "-I", "src"]

    def changed() -> bool:
        before = stamps("out/demo")
        assert idlc(*words).returncode == 0
        return stamps("out/demo") != before

    assert changed()
    assert not changed()
    make("src/dep_msgs/msg/B.msg", f"# a comment\n{MSG}")
    assert not changed()
    make("src/dep_msgs/msg/B.msg", "float32 speed\n")
    assert changed()
    make("pkg/msg/A.msg", "dep_msgs/B c\n")
    assert changed()
    assert not changed()
    make("pkg/srv/S.srv", "---\n")
    assert changed()
    Path("pkg/srv/S.srv").unlink()
    assert changed()
    assert not Path("out/demo/srv").exists()
    next(Path("out/demo/msg").glob("_*.py")).unlink()
    assert changed()
    assert idlc(*words, "--check").returncode == 0


def test_the_lock_names_nothing_of_this_machine(here):
    make("pkg/msg/A.msg", "std_msgs/Header header\n")
    make("pkg/action/G.action", "---\n---\n")
    assert idlc("gen", str(here / "pkg"), "-o", str(here / "out/demo")).returncode == 0
    text = Path("out/demo/idlc.lock").read_text(encoding="utf-8")
    assert str(here) not in text
    record = json.loads(text)
    assert record["inputs"].keys() == {"action/G.action", "msg/A.msg"}
    assert "std_msgs/msg/Header" in record["dependencies"]
    assert record["types"]["demo/action/G_Goal"].startswith("RIHS01_")
    written = {p.relative_to("out/demo").as_posix() for p in Path("out/demo").rglob("*.*")}
    assert record["outputs"].keys() == written - {"idlc.lock"}


def test_a_single_file_brings_the_neighbours_that_it_needs():
    make("demo/msg/A.msg", "B b\n")
    make("demo/msg/B.msg")
    make("demo/msg/C.msg")
    assert idlc("gen", "demo/msg/A.msg", "-o", "out/demo").returncode == 0
    names = {path.name for path in Path("out/demo/msg").iterdir()}
    assert {"_a.py", "_b.py"} <= names
    assert "_c.py" not in names
    assert "(unchanged)" in idlc("gen", "demo/msg/A.msg", "-o", "out/demo").stdout


def test_vendored_dependencies_are_whole_packages_with_locks_of_their_own():
    make("demo/msg/A.msg", "std_msgs/Header header\n")
    make("demo/action/G.action", "---\n---\n")
    done = idlc("gen", "demo", "-o", "out/demo", "--vendor-deps=beside")
    assert done.returncode == 0, done.stderr
    expected = {"action_msgs", "builtin_interfaces", "service_msgs", "std_msgs"}
    assert {p.name for p in Path("out").iterdir()} == expected | {"demo", "unique_identifier_msgs"}
    for package in expected:
        record = json.loads(Path(f"out/{package}/idlc.lock").read_text(encoding="utf-8"))
        assert record["package"] == package
        assert Path(f"out/{package}/_idlc").is_dir()
    assert "msg/String.msg" in json.loads(Path("out/std_msgs/idlc.lock").read_text())["inputs"]
    again = idlc("gen", "demo", "-o", "out/demo", "--vendor-deps=beside").stdout
    assert again.count("(unchanged)") == 6
    next(Path("out/std_msgs/msg").glob("_b*.py")).unlink()
    again = idlc("gen", "demo", "-o", "out/demo", "--vendor-deps=beside").stdout
    assert "files from 30 interfaces (1 written)" in again


def test_settings_come_from_the_nearest_pyproject_and_options_override_them(monkeypatch):
    text = '[tool.idlc]\npaths = ["interfaces"]\nout = "gen/demo"\ninclude = ["deps"]\n'
    make("pyproject.toml", text)
    make("interfaces/msg/A.msg", "dep_msgs/B b\n")
    make("deps/dep_msgs/msg/B.msg")
    Path("deep/er").mkdir(parents=True)
    monkeypatch.chdir("deep/er")
    assert idlc("check").stdout == "no problems in 1 file\n"
    assert idlc("gen").returncode == 0
    assert Path("../../gen/demo/msg/_a.py").is_file()
    assert idlc("gen", "-o", "elsewhere/other").returncode == 0
    assert Path("elsewhere/other/msg/_a.py").is_file()


def test_json_output_is_one_object_per_line():
    make("demo/msg/A.msg", "float64 class\nstereo_msgs/DisparityImage image\n")
    make("site/rclpy/__init__.py", "")
    env = {**os.environ, "PYTHONPATH": "site"}
    done = idlc("gen", "demo", "-o", "out/demo", "--format", "json", env=env)
    facts = [json.loads(line) for line in done.stdout.splitlines()]
    assert [fact["type"] for fact in facts][-2:] == ["package", "summary"]
    assert {fact["code"] for fact in facts if fact["type"] == "diagnostic"} == {
        "IDL220",
        "IDL222",
        "IDL617",
    }
    assert done.stderr == ""


@pytest.mark.parametrize("style", DOCUMENTS)
def test_what_ci_systems_read_of_generated_code(style, capfd):
    """One whole document, whatever there is to say, and nothing of it for people."""
    make("demo/msg/A.msg", "float64 a\n")
    words = ("gen", "demo", "-o", "out/demo", "--format", style)

    def printed(*more, status):
        assert main([*words, *more]) == status
        out, err = capfd.readouterr()
        assert err == ""
        return out

    assert printed("--check", status=1).count("IDL616") >= 1
    assert printed(status=0) == printed("--check", status=0)
    make("pyproject.toml", "[tool.idlc]\nout = 5\n")
    assert "IDL611" in printed("--check", status=2)
    Path("pyproject.toml").unlink()
    assert main([*words, "--watch"]) == 2


@pytest.mark.parametrize(
    ("variables", "colour"),
    [
        ({}, False),
        ({"FORCE_COLOR": "1"}, True),
        ({"CLICOLOR_FORCE": "1"}, True),
        ({"CLICOLOR_FORCE": "0"}, False),
        ({"CLICOLOR_FORCE": "1", "NO_COLOR": "1"}, False),
    ],
)
@pytest.mark.parametrize(
    "words",
    [
        ["check", "demo"],
        ["--help"],
        ["gen", "--help"],
        ["gen", "demo/msg/B.msg", "-o", "out"],
        ["show", "demo/msg/B.msg", "--format", "hash"],
        ["list"],
        ["show", "demo/msg/B.msg"],
        ["doctor"],
        ["explain", "IDL201"],
        ["no-such-command"],
        ["gen", "--no-such-option"],
    ],
    ids=" ".join,
)
def test_piped_output_is_plain_unless_colour_is_requested(
    words, variables, colour, capfd, monkeypatch
):
    make("demo/msg/A.msg", "flot64 a\n")
    make("demo/msg/B.msg", "float64 a 0.5  # [m]\n")
    for name, value in variables.items():
        monkeypatch.setenv(name, value)
    main(words)
    assert ("\x1b[" in "".join(capfd.readouterr())) is colour


@pytest.mark.parametrize(("variables", "colour"), [({}, False), ({"FORCE_COLOR": "1"}, True)])
def test_a_program_behind_a_pipe_prints_as_plainly(variables, colour):
    make("demo/msg/A.msg", "flot64 a\n")
    for words in (["check", "demo"], ["gen", "--no-such-option"]):
        done = idlc(*words, env={**os.environ, "PYTHONUTF8": "1", **variables})
        assert ("\x1b[" in done.stdout + done.stderr) is colour


@pytest.mark.parametrize(
    ("words", "headings"),
    [
        (["--help"], ("Usage:", "Options:", "Start:", "Example:")),
        (["scaffold", "node", "--help"], ("Options:", "Example, within a package:")),
        (["explain"], ("Syntax", "Files and projects")),
    ],
)
def test_headings_are_bold(words, headings):
    done = idlc(*words, env={**os.environ, "FORCE_COLOR": "1", "NO_COLOR": ""})
    for heading in headings:
        assert f"\x1b[1m{heading}\x1b[0m" in done.stdout


@pytest.mark.parametrize(
    ("words", "message", "hint"),
    [
        (["gne"], "no such command: `gne`", "did you mean `gen`?"),
        (["gen", "--wacth"], "no such option", "did you mean `--watch`?"),
        (["show"], "missing argument `TYPE|PATH|REC`", "`idlc show --help` lists the arguments"),
        (
            ["check", "--format", "xml"],
            "invalid value for `--format`: `xml` is not",
            "`idlc check --help`",
        ),
        (["check", "--format"], "option `--format` requires", "`idlc check --help`"),
        (["lsp", "x"], "unexpected argument `x`", "`idlc lsp --help`"),
        (["echo", "tcp/robot:7447"], "missing arg", "`idlc show tcp/robot:7447` lists the topics"),
        (["call", "dds"], "missing argument `SERVICE`", "`idlc show dds` lists the services"),
        (["record", "dds"], "missing option `-o` / `--out`", "`idlc record --help`"),
        (["echo", "ddss", "/odom"], "`ddss` is not an address", "did you mean `dds`?"),
    ],
)
def test_a_wrong_command_line_is_reported_like_every_other_problem(words, message, hint, capfd):
    assert main(words) == 2
    first, second = capfd.readouterr().err.splitlines()
    assert first.startswith(f"error: {message}")
    assert second.startswith(f"  = hint: {hint}")


#: Commands with a path or an address that leads nowhere.
PATHS = (
    "check {}",
    "columns {}",
    "columns {} /odom",
    "gen {} -o out",
    "show {}",
    "fmt {}",
    "docs {} -o site",
    "breaking {} --against .",
    "breaking --against {}",
    "upgrade {} -o up",
    "upgrade old/rec.mcap --to {} -o up",
    "upgrade old/rec.mcap --from {} -o up",
    "upgrade old/rec.mcap --rules {} -o up",
    "gen old -I {} -o out",
)


@pytest.mark.parametrize("command", PATHS)
def test_a_path_that_leads_nowhere_leads_to_the_closest_one(command, capsys):
    make("old/msg/Drive.msg")
    make("old/rec.mcap", "")
    assert main(command.format("odl/rec.mcp").split()) == 2
    shown = capsys.readouterr()
    assert "did you mean `old/rec.mcap`?" in shown.out + shown.err


@pytest.mark.parametrize(
    "command",
    [
        *(command for command in PATHS if "--against {}" not in command),
        *("echo {}", "call {} /x", "record {} -o x.mcap"),
    ],
)
def test_the_word_graph_leads_to_commands_that_work_with_running_nodes(command, capsys):
    make("old/msg/Drive.msg")
    make("old/rec.mcap", "")
    assert main(command.format("graph").split()) == 2
    shown = capsys.readouterr()
    hint = "`idlc show dds` lists what running nodes use, and `idlc breaking --against graph`"
    assert f"hint: {hint} compares it" in shown.out + shown.err


def test_a_terminal_that_knows_only_ascii_gets_ascii():
    make("demo/msg/A.msg", "float64 größe\n")
    done = idlc("check", "demo", env={**os.environ, "PYTHONIOENCODING": "ascii", "LC_ALL": "C"})
    assert done.returncode == 1
    assert done.stdout.isascii()


def test_file_names_that_are_not_text():
    Path("demo/msg").mkdir(parents=True)
    make(os.fsdecode(b"demo/msg/\xff\x1b[31m.msg"))
    done = idlc("check", "demo")
    assert done.returncode == 1
    assert "\x1b" not in done.stdout


def test_a_closed_pipe_is_no_error():
    with subprocess.Popen(
        [sys.executable, "-m", "idlc", "show", "sensor_msgs/msg/Image"],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
    ) as process:
        process.stdout.close()
        assert process.stderr.read() == b""
    assert process.returncode == 141


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="no /dev/full")
@pytest.mark.parametrize("words", ["show std_msgs/Header", "check .", "--help", "--version"])
def test_a_full_disk_is_no_internal_error(words):
    write(Path("msg/A.msg"), "int32 a\n")
    with Path("/dev/full").open("w") as full:
        command = [sys.executable, "-m", "idlc", *words.split()]
        done = subprocess.run(command, stdout=full, stderr=subprocess.PIPE, text=True, check=False)
    assert done.returncode == 2
    assert done.stderr.startswith("error: cannot write the output: no space left on device\n")
    assert "Exception ignored" not in done.stderr


@pytest.mark.skipif(os.name == "nt", reason="a POSIX shell closes the streams")
@pytest.mark.parametrize(
    ("closed", "printed"), [(">&-", ""), ("2>&-", "RIHS01_"), (">&- 2>&-", "")]
)
def test_a_closed_stream_is_no_error(closed, printed):
    command = shlex.join(
        [sys.executable, "-m", "idlc", "show", "std_msgs/Header", "--format", "hash"]
    )
    done = subprocess.run(
        ["/bin/sh", "-c", f"{command} {closed}"], capture_output=True, text=True, check=False
    )
    assert (done.returncode, done.stderr) == (0, "")
    assert done.stdout[:7] == printed


def test_ctrl_c_ends_with_the_status_that_shells_expect(monkeypatch, capsys):
    def interrupt(*_):
        raise KeyboardInterrupt

    monkeypatch.setattr("idlc.tasks.check.list_files", interrupt)
    assert main(["check", "."]) == 130
    assert capsys.readouterr().err.strip() == "interrupted"


def test_an_internal_error_shows_its_traceback_only_when_asked(monkeypatch, capsys):
    def fail(*_):
        raise RuntimeError("oh")

    make("demo/msg/A.msg")
    monkeypatch.setattr("idlc.language.parse.parse", fail)
    assert main(["check", "demo"]) == 3
    shown = capsys.readouterr().err
    assert "IDL901" in shown
    assert "stage `parse`" in shown
    assert "Traceback" not in shown
    monkeypatch.setenv("IDLC_DEBUG", "1")
    assert main(["check", "demo"]) == 3
    assert "Traceback" in capsys.readouterr().err


def test_a_huge_file_is_refused_unread():
    make("demo/msg/A.msg")
    os.truncate("demo/msg/A.msg", 100 << 30)  # sparse: reading it would take a minute
    done = idlc("check", "demo", timeout=20)
    assert done.returncode == 1
    assert "IDL604" in done.stdout


def test_messages_nested_deeper_than_pythons_stack():
    depth = 2000
    for number in range(depth):
        make(f"demo/msg/M{number}.msg", f"M{number + 1} m\n")
    make(f"demo/msg/M{depth}.msg", "M0 m\n")
    done = idlc("check", "demo")
    assert done.returncode == 1
    assert "IDL210" in done.stdout
    make(f"demo/msg/M{depth}.msg")
    assert idlc("check", "demo").returncode == 0
    assert len(idlc("show", "demo", "--format", "hash").stdout.splitlines()) == depth + 1


def test_a_name_longer_than_the_file_system_allows():
    make("demo/msg/A.msg", f"{'A' * 5000} a\nstd_msgs/{'B' * 5000} b\n{'c' * 5000}/C c\n")
    make("deps/x_msgs/msg/X.msg")
    done = idlc("check", "demo", "-I", "deps")
    assert done.returncode == 1
    assert done.stdout.count("error[IDL20") == 3
    assert idlc("show", f"std_msgs/msg/{'A' * 5000}").returncode == 2


def test_a_working_folder_that_is_gone():
    done = subprocess.run(
        ["/bin/sh", "-c", f"mkdir x && cd x && rmdir ../x && '{sys.executable}' -m idlc check"],
        capture_output=True,
        text=True,
        check=False,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
    )
    assert done.returncode == 2
    assert "the working folder is gone" in done.stderr


@pytest.mark.skipif(sys.platform == "win32", reason="a working folder is a short path there")
def test_a_working_folder_whose_path_is_too_long_to_be_opened(here, monkeypatch):
    """A package.xml above it could not be read, which would change the verdict silently."""
    make("A.msg")
    for _ in range(200):
        Path("d" * 40).mkdir()
        monkeypatch.chdir("d" * 40)
    make("A.msg")
    done = idlc("check", "A.msg", cwd=".")
    monkeypatch.chdir(here)
    shutil.rmtree("d" * 40)  # other tests may search the folders of all tests
    assert done.returncode == 2
    assert done.stderr.startswith(
        "error: the working folder cannot be opened: file name too long\n"
    )
    assert idlc("check", "A.msg").returncode == 0


def test_watching_compiles_after_each_change_and_ctrl_c_ends_it():
    make("demo/msg/A.msg")
    both = ["-o", "out/demo", "--ament", "prefix"]
    library = Path("prefix/lib/libdemo__rosidl_typesupport_cpp.so")
    with subprocess.Popen(
        [sys.executable, "-m", "idlc", "gen", "demo", *both, "--watch"],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        env={**os.environ, "PYTHONUTF8": "1"},
    ) as process:
        try:
            for _ in both[::2]:
                assert "from 1 interface" in read_line(process.stdout)
            assert "watching demo" in read_line(process.stderr)
            make("demo/msg/B.msg")
            wait_for(Path("out/demo/msg/_b.py").is_file)
            for _ in both[::2]:
                assert "from 2 interfaces" in read_line(process.stdout)
            assert b"__demo__msg__B\0" in library.read_bytes()
            make("demo/msg/B.msg", "flot64 broken\n")
            assert "IDL201" in read_line(process.stderr)
            Path("demo/msg/B.msg").unlink()
            wait_for(lambda: not Path("out/demo/msg/_b.py").exists())
            wait_for(lambda: b"__demo__msg__B\0" not in library.read_bytes())
        finally:
            process.send_signal(signal.SIGINT)
            _, err = process.communicate()
    assert process.returncode == 0
    assert "Traceback" not in err


def test_only_the_python_of_the_nodes_complains_about_what_it_cannot_import(monkeypatch, capsys):
    make("demo/msg/A.msg", "stereo_msgs/DisparityImage image\nstd_msgs/Header header\n")
    here = {"rclpy": ["/ros/rclpy"]}
    folders = "idlc.project.prefixes.python_folders"
    monkeypatch.setattr(folders, lambda package: [Path(one) for one in here.get(package, ())])
    assert main(["gen", "demo", "-o", "out/demo"]) == 0
    assert "warning[IDL617]" in capsys.readouterr().err
    # as in an environment of pipx, uv or pre-commit, which holds idlc alone
    here.clear()
    for words in (["gen", "demo", "-o", "out/demo"], ["gen", "demo", "-o", "other/demo"]):
        assert main(words) == 0
        said = capsys.readouterr()
        assert said.err == ""
        assert said.out.endswith("; imports std_msgs, stereo_msgs\n")
        assert main([*words, "--check"]) == 0
        assert "imports" not in "".join(capsys.readouterr())


def test_gen_names_the_idl_files_that_it_leaves_out(capsys, monkeypatch):
    alone = ["msg/Keyed.idl", "msg/\x1b[31m.idl", "srv/Ask.idl", "action/B.idl"]
    for folder in ("demo", "prefix/share/inst"):
        for path in ("msg/A.msg", "msg/A.idl", "msg/Keyed.idl.txt", *alone):
            write(f"{folder}/{path}", "int32 a\n")

    def notes(*words):
        assert main(["gen", *words]) == 0
        return [line for line in capsys.readouterr().err.splitlines() if ".idl" in line]

    (note,) = notes("demo", "-o", "out/demo")
    assert note.startswith("note: ")
    assert "`demo` lacks the types in `action/B.idl`, `msg/" in note
    assert "and 1 more" in note
    assert "\x1b" not in note
    assert notes("demo", "-o", "out/demo") == [note]
    assert notes("demo", "-o", "out/demo", "--check") == [note]
    assert notes("demo", "-o", "out/demo", "--exclude", "*.idl") == []
    assert notes("demo/msg/A.msg", "-o", "out/one", "--package", "one") == []
    monkeypatch.setenv("AMENT_PREFIX_PATH", str(Path("prefix").absolute()))
    write("prefix/share/ament_index/resource_index/rosidl_interfaces/inst", "msg/A.msg\n")
    assert len(notes("inst", "-o", "out/inst")) == 1
    assert notes("inst/msg/A", "-o", "out/inst") == []
    assert len(notes("inst/msg/A", "--ament", "overlay")) == 1


#: Ctrl-C while a module is imported.
INTERRUPTED = """
import sys

class Finder:
    def find_spec(self, name, *_):
        if name == sys.argv[1]:
            raise KeyboardInterrupt

sys.meta_path.insert(0, Finder())
from idlc.cli.main import main
sys.exit(main(sys.argv[2:]))
"""


@pytest.mark.parametrize(
    ("module", "words"),
    [
        ("idlc.cli.exit_status", ["--version"]),
        ("idlc.cli.run.check", ["check"]),
        ("idlc.cli.app", ["list"]),
        ("idlc.editor.server", ["lsp"]),
        ("click", ["list"]),
    ],
)
def test_ctrl_c_while_modules_are_imported(module, words, here):
    command = [sys.executable, "-c", INTERRUPTED, module, *words]
    done = subprocess.run(command, capture_output=True, text=True, check=False, cwd=here)
    assert (done.returncode, done.stdout, done.stderr) == (130, "", "interrupted\n")
