"""What differs on Windows and macOS, as far as it can be had here: by stand-ins for both.

The workflow of the repository runs these and the other tests there.
"""

import contextlib
import ctypes
import io
import json
import os
import pathlib
import shutil
import signal
import subprocess
import sys
import threading
from pathlib import Path
from types import SimpleNamespace

import pytest

from idlc.cli import streams
from idlc.cli.main import main
from idlc.diagnostics import formats
from idlc.project import atomic, lock, step
from tests.support import programs
from tests.support.files import write
from tests.support.paths import ROOT
from tests.support.waiting import LIMIT, join, read_line

WINDOWS = sys.platform == "win32"


def test_a_run_waits_for_another_one(tmp_path):
    """The real lock of this system, with another process."""
    code = (
        "import sys\nfrom pathlib import Path\nfrom idlc.project.atomic import exclusive\n"
        "with exclusive(Path('out')), exclusive(Path('out/demo')):\n"
        "    print('in', flush=True)\n"
        "    sys.stdin.readline()\n"
    )
    words = [sys.executable, "-c", code]
    pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE, "text": True, "cwd": tmp_path}
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    first = subprocess.Popen(words, env=environment, **pipes)
    assert read_line(first.stdout) == "in\n"
    second = subprocess.Popen(words, env=environment, **pipes)
    with pytest.raises(subprocess.TimeoutExpired):
        second.wait(1)
    first.communicate("\n")
    assert read_line(second.stdout) == "in\n"
    second.kill()
    assert second.communicate()[0] == ""


class Kernel:
    """The functions of Windows that idlc calls, for one process with several threads."""

    def __init__(self):
        self.mutex = threading.Lock()
        self.calls = []

    def __getattr__(self, name):
        def called(*words):
            self.calls.append(name)
            return getattr(type(self), f"on_{name}")(self, *words)

        self.__dict__[name] = called
        return called

    def on_CreateMutexW(self, *_):  # noqa: N802
        return 1 << 40  # more than an int of C holds

    def on_WaitForSingleObject(self, handle, wait):  # noqa: N802
        assert handle.value == 1 << 40
        return 0 if self.mutex.acquire(timeout=wait / 1000) else 258

    def on_ReleaseMutex(self, _):  # noqa: N802
        self.mutex.release()

    def on_CloseHandle(self, _):  # noqa: N802
        return 1


@pytest.fixture
def kernel(monkeypatch):
    """A Windows for the writer."""
    if WINDOWS:
        pytest.skip("Windows itself is here, and other tests use it")
    made = Kernel()
    monkeypatch.setattr(ctypes, "WinDLL", lambda *_, **__: made, raising=False)
    monkeypatch.setattr(atomic, "sys", SimpleNamespace(platform="win32"))
    return made


def test_the_lock_of_windows(kernel, tmp_path):
    entered = threading.Event()

    def other():
        with atomic.only_writer_on_windows():
            entered.set()

    with atomic.exclusive(tmp_path / "a"):
        with atomic.exclusive(tmp_path / "a/b"):
            assert kernel.calls.count("CreateMutexW") == 1, "it does not wait for itself"
        thread = threading.Thread(target=other)
        thread.start()
        assert not entered.wait(0.3)
    thread.join(10)
    assert entered.is_set()
    with contextlib.suppress(KeyError), atomic.exclusive(tmp_path):
        raise KeyError
    assert not kernel.mutex.locked()


@pytest.mark.usefixtures("kernel")
def test_a_file_that_is_open_for_a_moment_is_replaced(tmp_path, monkeypatch):
    """Scanners and editors hold new files open; Windows moves nothing over those."""
    real, refused = os.replace, []

    def replace(source, target):
        if len(refused) < 2:
            refused.append(target)
            raise PermissionError(13, "Access is denied")
        real(source, target)

    monkeypatch.setattr(os, "replace", replace)
    monkeypatch.setattr(atomic.time, "sleep", lambda _: None)
    write(tmp_path / "demo/msg/A.msg", "int8 a\n")
    monkeypatch.chdir(tmp_path)
    assert main(["gen", "demo", "-o", "out/demo"]) == 0
    assert len(refused) == 2
    refused[:] = []
    write(tmp_path / "demo/msg/A.msg", "int8   a\n")
    assert main(["fmt", "demo"]) == 0
    assert len(refused) == 2


@pytest.mark.usefixtures("kernel")
def test_a_file_that_stays_open_is_told_and_nothing_changes(tmp_path, monkeypatch, capsys):
    def replace(source, target):
        raise PermissionError(13, "Access is denied")

    monkeypatch.setattr(os, "replace", replace)
    monkeypatch.setattr(atomic.time, "sleep", lambda _: None)
    write(tmp_path / "demo/msg/A.msg", "int8 a\n")
    monkeypatch.chdir(tmp_path)
    assert main(["gen", "demo", "-o", "out/demo"]) == 2
    assert "[IDL612]" in capsys.readouterr().err
    assert not Path("out").exists()


def test_a_file_is_closed_before_it_is_removed(tmp_path, monkeypatch):
    """Windows removes no file that is open: half of one would stay."""
    held = set()
    opened, close, unlink = os.open, os.close, Path.unlink

    def counting(path, *words, **options):
        handle = opened(path, *words, **options)
        held.add((handle, str(path)))
        return handle

    def closing(handle):
        close(handle)
        for one in [one for one in held if one[0] == handle]:
            held.discard(one)

    def removing(path, **options):
        if any(name == str(path) for _, name in held):
            raise PermissionError(13, "it is being used by another process", str(path))
        unlink(path, **options)

    def write_nothing(handle, data):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "open", counting)
    monkeypatch.setattr(os, "close", closing)
    monkeypatch.setattr(os, "write", write_nothing)
    monkeypatch.setattr(Path, "unlink", removing)
    with pytest.raises(OSError, match="No space"):
        atomic.create(str(tmp_path / "a.py"), b"x")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.usefixtures("kernel")
def test_ctrl_c_waits_until_files_are_in_place():
    done = []

    def moves():
        with atomic.uninterrupted():
            signal.raise_signal(signal.SIGINT)
            done.append("moved")

    with pytest.raises(KeyboardInterrupt):
        moves()
    assert done == ["moved"]
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler


def test_ctrl_c_waits_also_where_other_threads_can_receive_it():
    done, begun = [], threading.Event()
    other = threading.Thread(
        target=lambda: (begun.wait(LIMIT), signal.raise_signal(signal.SIGINT)), daemon=True
    )
    other.start()  # before it could inherit blocked signals

    def moves():
        with atomic.uninterrupted():
            begun.set()
            join(other)
            done.append("moved")

    with pytest.raises(KeyboardInterrupt):
        moves()
    assert done == ["moved"]


# what is printed


def printed(monkeypatch, text, encoding="cp1252", ends="\r\n"):
    """Return the bytes of text on a stream as Windows makes them for files and pipes."""
    raw = io.BytesIO()
    stream = io.TextIOWrapper(raw, encoding=encoding, newline=ends)
    monkeypatch.setattr(sys, "stdout", stream)
    streams.set_up()
    stream.write(text)
    stream.flush()
    return raw.getvalue()


def test_what_windows_redirects_is_what_others_redirect(monkeypatch):
    monkeypatch.setattr(streams.sys, "platform", "win32")
    monkeypatch.delenv("PYTHONIOENCODING", raising=False)
    text = "größe → €\udcff\n"
    assert printed(monkeypatch, text) == "größe → €\\udcff\n".encode()
    monkeypatch.setenv("PYTHONIOENCODING", "cp1252")
    assert printed(monkeypatch, text) == "größe -> €\\udcff\n".encode("cp1252")


def test_a_terminal_with_few_signs_gets_others_for_them(monkeypatch):
    monkeypatch.setenv("PYTHONIOENCODING", "as given")
    assert printed(monkeypatch, "a → b… ☃\n", "cp1252", "\n") == b"a -> b\x85 \\u2603\n"
    assert printed(monkeypatch, "a → b… ß☃→\n", "ascii", "\n") == b"a -> b... \\xdf\\u2603->\n"


def test_xml_is_read_alike_whatever_encoding_it_is_written_in(here, capsys):
    write("größe/msg/A.msg", "flot64 größe\n")
    assert main(["check", "größe", "--format", "junit"]) == 1
    text = capsys.readouterr().out
    assert text.isascii()
    assert "gr&#246;&#223;e/msg/A.msg" in text


@pytest.mark.parametrize(
    ("system", "path", "uri"),
    [
        ("linux", "/a b/ü.msg", "file:///a%20b/%C3%BC.msg"),
        ("linux", "c:/x.msg", "c%3A/x.msg"),
        ("win32", "C:/a b/x.msg", "file:///C:/a%20b/x.msg"),
        ("win32", "a/b.msg", "a/b.msg"),
    ],
)
def test_paths_in_sarif(system, path, uri, monkeypatch):
    monkeypatch.setattr(formats, "sys", SimpleNamespace(platform=system))
    assert formats._artifact(path) == {"uri": uri}


# files as git checks them out on Windows


def test_interfaces_with_other_line_ends_mean_the_same(here, capsysbinary):
    text = (
        "# what\n#\n# more\nfloat64 speed 0.5  # [m/s]\nstring<=5[<=3] names ['a', 'b']\nint8 A=1\n"
    )
    found = []
    for name, ends in (("unix", "\n"), ("windows", "\r\n")):
        folder = Path(name) / "demo"
        for path, body in (("msg/Drive.msg", text), ("srv/Ask.srv", "int8 a\n---\nint8 b\n")):
            (folder / path).parent.mkdir(parents=True, exist_ok=True)
            (folder / path).write_bytes(body.replace("\n", ends).encode())
        assert main(["check", str(folder)]) == 0
        assert main(["fmt", "--check", str(folder)]) == 0
        assert main(["gen", str(folder), "-o", f"{name}/out/demo"]) == 0
        out = Path(name) / "out"
        files = {path.relative_to(out): path.read_bytes() for path in out.rglob("*.py")}
        lock = json.loads((out / "demo/idlc.lock").read_bytes())
        found.append((files, lock["types"]))
    (unix, types), (windows, other_types) = found
    assert types == other_types
    assert [path for path in unix if windows.get(path) != unix[path]] == []


def test_generated_code_with_other_line_ends_is_still_idlcs_own(here, capsys):
    """As after a checkout with core.autocrlf: the content is what idlc wrote."""
    write("demo/msg/Drive.msg", "float64 speed\n")
    assert main(["gen", "demo", "-o", "out/demo"]) == 0
    for path in Path("out").rglob("*"):
        if path.is_file():
            path.write_bytes(path.read_bytes().replace(b"\n", b"\r\n"))
    capsys.readouterr()
    assert main(["gen", "demo", "-o", "out/demo", "--check"]) == 0, capsys.readouterr().err
    Path("demo/msg/Drive.msg").write_bytes(b"float64 speed\r\n")
    assert main(["gen", "demo", "-o", "out/demo", "--check"]) == 0, capsys.readouterr().err
    write("demo/msg/Drive.msg", "float32 speed\n")
    assert main(["gen", "demo", "-o", "out/demo"]) == 0, capsys.readouterr().err
    assert main(["gen", "demo", "-o", "out/demo", "--check"]) == 0


def test_a_real_edit_is_still_noticed(here, capsys):
    """A library is no text: in it no byte is a line end."""
    write("demo/msg/Drive.msg", "float64 speed\n")
    assert main(["gen", "demo", "-o", "out/demo"]) == 0
    module = Path("out/demo/msg/_drive.py")
    module.write_bytes(module.read_bytes().replace(b"\n", b"\r\n") + b"# mine\r\n")
    assert main(["gen", "demo", "-o", "out/demo", "--check"]) == 1
    assert "was edited after" in capsys.readouterr().err
    assert step.digest(b"\x7fELF\0\r\n") != step.digest(b"\x7fELF\0\n")
    assert not lock.is_same(b"\x7fELF\0\r\n", b"\x7fELF\0\n")


def test_scaffolding_again_after_a_checkout_changes_nothing(here, capsys):
    words = ["scaffold", "package", "demo", "--maintainer", "x", "--license", "Apache-2.0"]
    assert main(words) == 0
    for path in Path("demo").rglob("*"):
        if path.is_file():
            path.write_bytes(path.read_bytes().replace(b"\n", b"\r\n"))
    before = {path: path.read_bytes() for path in Path("demo").rglob("*") if path.is_file()}
    capsys.readouterr()
    assert main(words) == 0, capsys.readouterr()
    assert all(path.read_bytes() == data for path, data in before.items())


# file systems that ignore capitals


@pytest.fixture
def folding(monkeypatch):
    """A file system that finds files by names with other capitals, as those of macOS do."""
    functions = {name: getattr(os, name) for name in ("lstat", "stat", "open", "replace", "unlink")}
    listed = os.listdir

    def found(path):
        whole = os.fspath(path)
        folder, name = os.path.split(whole)
        with contextlib.suppress(OSError):
            for other in listed(folder or "."):
                if other.casefold() == name.casefold():
                    return f"{folder}/{other}" if folder else other
        return whole

    def wrapped(name):
        def function(path, *words, **options):
            if name == "replace":
                # what is there gives way, and the new name counts
                with contextlib.suppress(FileNotFoundError):
                    functions["unlink"](found(words[0]))
                return functions[name](path, *words)
            return functions[name](
                found(path) if isinstance(path, str | Path) else path, *words, **options
            )

        return function

    for name in functions:
        monkeypatch.setattr(os, name, wrapped(name))
    if sys.version_info < (3, 11):  # pathlib has functions of os in a class of its own there
        for name in ("stat", "replace", "unlink"):
            monkeypatch.setattr(pathlib._NormalAccessor, name, staticmethod(wrapped(name)))


@pytest.mark.usefixtures("folding")
def test_a_type_is_called_with_other_capitals(here, capsys):
    """Pages and installed interfaces have the names of types; none may be lost, none refused."""
    for number, name in enumerate(("DriveCmd", "Drivecmd", "DriveCmd")):
        shutil.rmtree("demo", ignore_errors=True)
        write(f"demo/msg/{name}.msg", f"int8[{number + 1}] a  # what\n")
        assert main(["docs", "demo", "-o", "site"]) == 0, capsys.readouterr().err
        assert main(["gen", "demo", "--ament", "prefix"]) == 0, capsys.readouterr().err
        assert f"{name}</" in Path(f"site/demo/msg-{name}.html").read_text(encoding="utf-8")
        kept = sorted(path.name for path in Path("prefix/share/demo/msg").iterdir())
        assert kept == sorted(f"{name}.{ending}" for ending in ("idl", "json", "msg"))
        text = Path(f"prefix/share/demo/msg/{name}.msg").read_text(encoding="utf-8")
        assert text.startswith(f"int8[{number + 1}]")


def test_no_file_is_read_or_written_in_the_encoding_of_the_country(tmp_path):
    write(tmp_path / "demo/msg/A.msg", "float64 a  # größe [m]\n")
    code = (
        "import sys\nfrom idlc.cli.main import main\n"
        "for line in sys.argv[1:]:\n"
        "    status = main(line.split())\n"
        "    assert status == 0, (line, status)\n"
    )
    lines = (
        "gen demo -o out/demo",
        "gen demo --ament prefix",
        "check demo --fix",
        "fmt demo",
        "docs demo -o site",
        "breaking demo --against out/demo/idlc.lock",
        "scaffold package nodes",
        "scaffold package --interfaces kinds A srv/B",
        "check nodes kinds",
    )
    words = ("-X", "warn_default_encoding", "-W", "error::EncodingWarning", "-c", code)
    programs.run(sys.executable, *words, *lines, cwd=tmp_path)
