"""Very large input: done in time and memory that grow with its size, or refused in plain words.

Growth is measured in calls. What happens inside of C, such as in patterns and copies, is measured
by letting the process have so much processor time and memory that only linear work can end.
"""

import contextlib
import io
import json
import os
import subprocess
import sys
from collections import Counter
from pathlib import Path

import pytest

import idlc.model.link
import idlc.model.lowering.lower
import idlc.project.inputs
from idlc.cli.main import main
from idlc.wire.layout import MAX_DEPTH
from tests.support.files import write
from tests.support.rounds import FUZZING, some

#: How much larger input is when there is time, as in `make fuzz`.
SCALE = 5 if FUZZING else 1
A = "msg/A.msg"


def numbered(line, count):
    return "".join(line.replace("@", str(number)) + "\n" for number in range(count))


def chain(count, last="int8 x\n"):
    files = {f"msg/M{number}.msg": f"M{number + 1} x\n" for number in range(count)}
    return {**files, f"msg/M{count}.msg": last}


#: Files of a package by what there is much of; each grows with its number.
MANY = {
    "fields": lambda n: {A: numbered("int32 f@", n)},
    "texts": lambda n: {A: numbered('string f@ "x"', n)},
    "messages": lambda n: {A: numbered("B f@", n), "msg/B.msg": "string x\nint8 y\n"},
    "constants": lambda n: {A: numbered("int32 F@=@", n)},
    "constants of a service": lambda n: {"srv/A.srv": numbered("int32 F@=@", n) * 1 + "---\n"},
    "moved constants": lambda n: {"srv/A.srv": "---\n".join([numbered("int8 F@=1", n)] * 2)},
    "units": lambda n: {A: numbered("int32 f@  # [m]", n)},
    "files": lambda n: numbered_files(n),
    "used files": lambda n: {**numbered_files(n), A: numbered("M@ f@", n)},
    "elements": lambda n: {A: f"int32[] a [{', '.join(['1'] * n)}]\n"},
    "text elements": lambda n: {A: "string[] a [" + ", ".join(["'x'"] * n) + "]\n"},
    "comment lines": lambda n: {A: "# x\n" * n + "\nint8 a\n"},
    "comments below": lambda n: {A: "int8 a\n" + "  # x\n" * n},
    "actions": lambda n: {f"action/A{i}.action": "int8 x\n---\n---\n" for i in range(n)},
    "a chain": lambda n: chain(n // 10),
    "a chain of packages": lambda n: chain_of_packages(n // 4),
    "tags of package.xml": lambda n: xml(n, "<depend>std_msgs</depend>"),
    "tags in tags": lambda n: xml(1, "<a>" * n + "</a>" * n),
}


def chain_of_packages(count):
    """Each package uses the next, so that the first needs all."""
    files = {}
    for number in range(count):
        files[f"p{number}/package.xml"] = f"<package><name>p{number}</name></package>"
        files[f"p{number}/msg/A.msg"] = f"p{number + 1}/A a\n" if number < count - 1 else "int8 a\n"
    return files


def xml(count, text):
    manifest = f"<package><name>p</name>{text * count}</package>"
    return {"package.xml": manifest, A: "int8 x\n"}


#: The same, of what idlc complains about.
MANY_PROBLEMS = {
    "duplicates": lambda n: {A: "int32 x\n" * n},
    "unknown types": lambda n: {A: numbered("Foo@ f@", n)},
    "unknown types, many files": lambda n: {**numbered_files(n), A: numbered("Foo@ f@", 20 * n)},
    "unknown packages": lambda n: {A: numbered("foo@_msgs/Foo f@", n)},
    "unknown names": lambda n: {A: numbered("foo@ f@", n)},
    "broken lines": lambda n: {A: numbered("f[@ a", n)},
    "separators": lambda n: {A: "---\n" * n},
    "unusual line ends": lambda n: {A: "\x0c" * n},
    "marks in quotes": lambda n: {A: numbered("string s@ 'a#'", n)},
    "bad values": lambda n: {A: numbered("int8 f@ 1000", n)},
    "a circle": lambda n: {f"msg/M{i}.msg": f"M{(i + 1) % n} x\n" for i in range(n)},
    "many circles": lambda n: chain(n, "".join(f"M{i} x{i}\n" for i in range(n))),
    "backslashes": lambda n: {A: numbered(r"int8 f@  # \x", n)},
}


def numbered_files(count):
    return {f"msg/M{number}.msg": "int32 x\n" for number in range(count)}


def make(folder: Path, files: dict[str, str]) -> None:
    for path, text in files.items():
        write(folder / path, text)


def calls(words: list[str]) -> int:
    """Return how many functions a command calls, those of C included."""
    count = 0

    def counted(_frame, event, _argument):
        nonlocal count
        count += event in ("call", "c_call")

    out = io.StringIO()
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(out):
        sys.setprofile(counted)
        try:
            status = main(words)
        finally:
            sys.setprofile(None)
    assert status in (0, 1, 2), out.getvalue()
    return count


@pytest.fixture(autouse=True)
def here(here):
    (here / ".git").mkdir()
    return here


def assert_linear(files_of, words_of, start=100):
    """Twice as much takes twice as many calls more, not four times as many."""
    counts = []
    for number in (4 * start, start, 2 * start, 4 * start):  # the first time, caches are filled
        folder = Path(str(len(counts))) / str(number)
        make(folder, files_of(number))
        counts.append(calls(words_of(folder.as_posix())))
    _, one, two, four = counts
    assert four - two <= 2.5 * (two - one) + 500, counts[1:]


@pytest.mark.parametrize("what", some([*MANY, *MANY_PROBLEMS]))
def test_checking_is_linear(what):
    assert_linear({**MANY, **MANY_PROBLEMS}[what], lambda folder: ["check", folder])


@pytest.mark.parametrize("command", [["check"], ["show"], ["breaking", "--against", "ws"]])
def test_each_file_is_read_and_lowered_once_however_many_packages_use_it(command, monkeypatch):
    make(Path("ws"), {**chain_of_packages(30), "q/msg/B.msg": "p0/A a\np7/A b\n"})
    lowered, read = Counter(), Counter()

    def lower(file, *rest):
        lowered[file.source.path] += 1
        return lower_(file, *rest)

    def read_bytes(path, *rest):
        read[os.path.relpath(path)] += 1
        return read_bytes_(path, *rest)

    lower_, read_bytes_ = idlc.model.lowering.lower.lower, idlc.project.files.read_bytes
    for module in ("idlc.model.lowering.lower.lower", "idlc.model.link.lower"):
        monkeypatch.setattr(module, lower)
    monkeypatch.setattr("idlc.project.files.read_bytes", read_bytes)
    assert main([command[0], "ws", *command[1:]]) == 0
    versions = 2 if command[0] == "breaking" else 1
    files = [*(f"ws/p{n}/msg/A.msg" for n in range(30)), "ws/q/msg/B.msg"]
    assert lowered == dict.fromkeys(files, versions)
    assert {path: n for path, n in read.items() if path.endswith(".msg")} == lowered


@pytest.mark.parametrize(
    "what", ["fields", "texts", "messages", "constants", "used files", "actions"]
)
def test_generating_is_linear(what):
    assert_linear(
        MANY[what], lambda folder: ["gen", folder, "-o", f"out/{Path(folder).parts[0]}/p"], 15
    )


@pytest.mark.parametrize(
    "what", ["fields", "units", "constants", "comment lines", "comments below"]
)
def test_laying_out_is_linear(what):
    assert_linear(MANY[what], lambda folder: ["fmt", folder])


@pytest.mark.parametrize("what", ["fields", "messages", "constants", "units", "a chain"])
def test_showing_is_linear(what):
    path = "msg/M0.msg" if what == "a chain" else A
    assert_linear(MANY[what], lambda folder: ["show", f"{folder}/{path}", "--package", "p"])


@pytest.mark.parametrize("what", ["files", "used files", "actions"])
def test_hashing_is_linear(what):
    assert_linear(MANY[what], lambda folder: ["show", folder, "--format", "hash"])


@pytest.mark.parametrize("what", ["fields", "messages", "constants", "units", "files", "actions"])
def test_documenting_is_linear(what):
    assert_linear(
        MANY[what], lambda folder: ["docs", folder, "-o", f"site/{Path(folder).parts[0]}"], 50
    )


CHANGES = {
    "kept": (MANY["fields"], MANY["fields"]),
    "removed": (MANY["fields"], lambda _: {A: "int8 x\n"}),
    "added": (lambda _: {A: "int8 x\n"}, MANY["fields"]),
    "renamed": (MANY["fields"], lambda n: {A: numbered("int32 g@", n)}),
    "replaced": (MANY["fields"], lambda n: {A: numbered("string g@", n)}),
    "every other": (MANY["fields"], lambda n: {A: numbered("int32 f@\nint8 g@", n)}),
    "constants renamed": (MANY["constants"], lambda n: {A: numbered("int32 G@=@", n)}),
    "constants replaced": (MANY["constants"], lambda n: {A: numbered("int8 G@=1", n % 100)}),
    "files renamed": (
        MANY["files"],
        lambda n: {f"msg/N{number}.msg": "int32 x\n" for number in range(n)},
    ),
    "large arrays": (
        lambda n: {A: f"int16[{n}] a\nint8 b\n"},
        lambda n: {A: f"int16[{n}] a\nbool b\n"},
    ),
    "nested sequences": (lambda n: sequences(n // 10, "x"), lambda n: sequences(n // 10, "y")),
}


def sequences(depth, last):
    files = {f"msg/M{number}.msg": f"M{number + 1}[] x\n" for number in range(depth)}
    return {**files, f"msg/M{depth}.msg": f"int8 {last}\n"}


@pytest.mark.parametrize("what", CHANGES)
def test_comparing_is_linear(what, here):
    old, new = CHANGES[what]

    def words(folder):
        number = int(Path(folder).name)
        make(here / folder / "old", old(number))
        return ["breaking", f"{folder}/new", "--against", f"{folder}/old"]

    # a structure is followed anew for each that holds it, so a chain takes its length squared
    start = 40 if what == "nested sequences" else 100
    if what == "nested sequences":
        make(here / "deep/new", new(900))
        make(here / "deep/old", old(900))
        assert calls(["breaking", "deep/new", "--against", "deep/old"]) < 3_000_000
        return
    assert_linear(lambda n: {f"new/{path}": text for path, text in new(n).items()}, words, start)


#: One thing that is very long, and the code that it ends with, if any.
LONG = {
    "line": ("x" * 10_000_000, "IDL101"),
    "blank line": (" " * 10_000_000 + "x y", "IDL102"),
    "type": ("A" * 1_000_000 + " x", "IDL201"),
    "lower-case type": ("a_" * 500_000 + " x", "IDL205"),
    "array": ("int32" + "[" * 1_000_000 + " x", "IDL103"),
    "field": ("int8 " + "a" * 1_000_000, ""),
    "bad field": ("int8 " + "a_" * 500_000, "IDL203"),
    "constant": ("int8 " + "A" * 1_000_000 + "_=1", "IDL204"),
    "default": ('string a "' + "x" * 10_000_000 + '"', ""),
    "long default": ('string a "' + "x" * 2_000_000 * SCALE + '"', ""),
    "default of backslashes": ('string a "' + "\\\\" * 1_000_000 + '"', "IDL311"),
    "default of quotes": ('string a "' + '\\"' * 1_000_000 + '"', ""),
    "array of escaped quotes": ('string[] a ["' + '\\"' * 1_000_000 + "]", "IDL304"),
    "array of quotes": ('string[] a ["' + '\\"' * 100_000 + 'x"]', ""),
    "array of blanks": ("string[] a [" + " " * 1_000_000 + "]", "IDL308"),
    "integer": ("int32 x " + "1" * 5_000_000, "IDL304"),
    "hexadecimal": ("int32 x 0x" + "1" * 5_000_000, "IDL305"),
    "real": ("float64 x " + "1" * 5_000_000, "IDL310"),
    "no real": ("float64 x " + "1" * 1_000_000 + "x", "IDL304"),
    "no real, with underscores": ("float64 x " + "1_" * 1_000_000 + "x", "IDL304"),
    "bound": ("int32[" + "1" * 4_000_000 + "] x", "IDL301"),
    "size": ("int32[" + "1" * 4_000 + "] x", ""),
    "comment": ("int8 x  # " + "x y " * 250_000, ""),
    "comment of brackets": ("int8 x  # " + "[" * 1_000_000, ""),
    "comment of brackets and commas": ("int8 x  # " + "[," * 500_000, ""),
    "comment of units": ("int8 x  # " + "[m] " * 250_000, ""),
    "comment of remarks": ("int8 x  # " + "idlc: ignore[" * 80_000, ""),
    "comment of one remark": ("int8 x  # idlc: ignore[" + " " * 1_000_000, ""),
    "comment of half a remark": ("int8 x  # idlc:" + " " * 1_000_000, ""),
    "comment of blanks": ("int8 x  # " + " " * 1_000_000 + "[", ""),
    "comment of backslashes": ("int8 x  # " + "\\\\" * 500_000, ""),
    "comment of escapes": ("int8 x  # " + "\\q" * 500_000, ""),
    "comment lines": ("int8 x\n" + "  # [x\n" * 50_000 * SCALE, ""),
    "empty comment lines": ("#\n" * 50_000 * SCALE + "int8 x", ""),
    "dashes": ("-" * 1_000_000, "IDL105"),
    "many dashes": ("---\n" * 100_000, "IDL104"),
    "many blank lines": ("\n" * 80_000 * SCALE, ""),
    "many constants": (numbered("int8 F@=1", 20_000 * SCALE), ""),
    "many fields": (numbered("int8 f@", 20_000 * SCALE), ""),
}
#: What a process may use of either; quadratic work takes hours, copies of copies terabytes.
PROCESSOR_SECONDS = 120
MEMORY = 3 << 30
LIMITED = f"""
import contextlib, io, json, resource, sys
resource.setrlimit(resource.RLIMIT_CPU, ({PROCESSOR_SECONDS}, {PROCESSOR_SECONDS}))
resource.setrlimit(resource.RLIMIT_AS, ({MEMORY}, {MEMORY}))
from idlc.cli.main import main
from idlc.wire.layout import MAX_DEPTH
for words in json.load(sys.stdin):
    out = io.StringIO()
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(out):
        status = main(words)
    print(json.dumps([words, status, out.getvalue()]), flush=True)
"""


def limited(commands):
    """Run commands in one process with limits; return status and output of each by its words."""
    done = subprocess.run(
        [sys.executable, "-c", LIMITED],
        input=json.dumps(commands),
        capture_output=True,
        text=True,
        check=False,
    )
    said = [json.loads(line) for line in done.stdout.splitlines()]
    assert len(said) == len(commands), f"{commands[len(said)]}: {done.stderr[-500:]}"
    return {" ".join(words): (status, out) for words, status, out in said}


@pytest.mark.long
def test_what_is_very_long_is_judged_soon(here):
    for number, (text, _) in enumerate(LONG.values()):
        make(here / f"p{number}", {A: text + "\n"})
    said = limited([["check", f"p{number}"] for number in range(len(LONG))])
    for number, (what, (_, code)) in enumerate(LONG.items()):
        status, out = said[f"check p{number}"]
        assert code in out, f"{what}: {out[:300]}"
        assert status == int("error[" in out), what
        assert code or not status, f"{what}: {out[:300]}"
        assert len(out) < 1_000_000, what


@pytest.mark.long
def test_what_is_very_long_is_generated_and_laid_out_soon(here):
    chosen = ["long default", "comment", "comment of units", "size", "real", "many fields"]
    for number, what in enumerate(chosen):
        make(here / f"p{number}", {A: LONG[what][0] + "\n"})
    numbers = range(len(chosen))
    commands = [["gen", f"p{number}", "-o", f"out/p{number}"] for number in numbers[:-1]]
    commands += [["breaking", f"p{number}", "--against", f"p{number}"] for number in numbers]
    commands += [["show", f"p{number}/{A}"] for number in numbers]
    commands += [["docs", f"p{number}", "-o", f"site/p{number}"] for number in numbers]
    commands += [["fmt", f"p{number}"] for number in numbers]
    for words, (status, out) in limited(commands).items():
        assert status == 0, f"{words}: {out[:300]}"


def test_a_pyproject_toml_of_deep_keys_is_refused_soon(here):
    """Reading a key of TOML takes time by the square of its parts."""
    make(here / "pkg", {A: "int8 a\n"})
    (here / "pyproject.toml").write_text(f"[tool.idlc]\na{'.b' * 40_000} = 1\n")
    ((status, out),) = limited([["check", "pkg"]]).values()
    assert status == 2
    assert "IDL611" in out
    assert "too many dots" in out


@pytest.mark.parametrize(
    "text",
    ["<a>" * 400_000 + "</a>" * 400_000, "<depend>é</depend>" * 100_000],
    ids=["tags in tags", "statements"],
)
def test_a_package_xml_of_many_tags_is_read_soon(text, here):
    make(here / "pkg", {**xml(1, text), A: "int8 x\n"})
    commands = [["check", "pkg"], ["gen", "pkg", "-o", "out/p"]]
    commands += [["breaking", "pkg", "--against", "pkg"]]
    for words, (status, out) in limited(commands).items():
        assert status == 0, f"{words}: {out[:300]}"


def test_a_cmake_file_of_many_lists_is_read_soon(here):
    lists = numbered("set(v@ std_msgs)\nlist(APPEND w@ std_msgs)", 12_000)
    words = numbered("${v@}", 12_000)
    text = f"{lists}rosidl_generate_interfaces(p {A} DEPENDENCIES {words})"
    make(here / "pkg", {**xml(1, ""), A: "int8 x\n", "CMakeLists.txt": text})
    limited([["check", "pkg"]])


LARGE = {
    "100 MB": (None, "IDL604", "larger than 16 MiB"),
    "lines": ("\n" * 600_000, "IDL604", "more than 500,000 lines"),
    "elements": (f"int8[] a [{'1,' * 300_000}1]\n", "IDL604", "more than 200,000 elements"),
    "text elements": (f"string[] a [{'1,' * 300_000}1]\n", "IDL604", "more than 200,000 elements"),
    "fields": (numbered("int32 f@", 100_000), "IDL619", "100,000 fields"),
}


@pytest.mark.parametrize("what", LARGE)
def test_what_is_too_large_is_refused_in_plain_words(what, here):
    text, code, words = LARGE[what]
    make(here / "pkg", {A: text or ""})
    if text is None:
        with (here / "pkg" / A).open("r+b") as file:
            file.truncate(100 << 20)
    commands = [["gen", "pkg", "-o", "out/pkg"]]
    if code == "IDL604":  # the others are too large for generated code only
        commands += [["check", "pkg"], ["fmt", "pkg"], ["docs", "pkg", "-o", "site"]]
        commands += [["breaking", "pkg", "--against", "pkg"], ["show", f"pkg/{A}"]]
    for command, (status, out) in limited(commands).items():
        assert status in (1, 2), command
        assert f"error[{code}]" in out, command
        assert words in out, command
    assert not (here / "out").exists()
    assert not (here / "site").exists()


@pytest.mark.long
def test_ten_thousand_files(here):
    make(here / "pkg", numbered_files(10_000))
    commands = [["check", "pkg"], ["fmt", "--check", "pkg"], ["show", "pkg", "--format", "hash"]]
    said = limited([*commands, ["breaking", "pkg", "--against", "pkg"]])
    assert [status for status, _ in said.values()] == [0, 0, 0, 0]
    assert said["show pkg --format hash"][1].count("RIHS01_") == 10_000


def test_a_chain_of_a_thousand_dependencies(here):
    make(here / "pkg", chain(1000))
    for words, expected in (
        (["check", "pkg"], 0),
        (["show", "pkg", "--format", "hash"], 0),
        (["gen", "pkg", "-o", "out/pkg"], 2),
        (["breaking", "pkg", "--against", "pkg"], 2),
    ):
        status, out = limited([words])[" ".join(words)]
        assert status == expected, out[:300]
        assert ("IDL619" in out) == bool(expected)
        assert "nests messages 1001 deep" in out or not expected


#: Uses a class where a program has called many functions already, as in a test or a callback.
DEEP = """
import copy, sys
sys.path.insert(0, "out")

def below(frames):
    if frames:
        return below(frames - 1)
    from p0.msg import M
    message = M()
    for order in ("little", "big"):
        assert M.deserialize(message.serialize(byteorder=order)) == message
    assert M.from_dict(message.to_dict()) == message == copy.deepcopy(message)
    message.validate()
    repr(message)
    try:
        M.deserialize(b"\\0\\1\\0\\0")
    except ValueError as error:
        assert str(error).startswith("x.x.x."), error
    return M

below(300)
"""


def test_a_chain_of_packages_as_deep_as_they_may_be_can_be_used(here):
    for number in range(MAX_DEPTH):
        last = number == MAX_DEPTH - 1
        field = "int8 x\n" if last else f"p{number + 1}/M x\n"
        make(here / "src", {f"p{number}/msg/M.msg": field})
    words = ["gen", "src/p0/msg", "--package", "p0", "-o", "out/p0", "-I", "src"]
    words += ["--vendor-deps=beside"]
    status, out = limited([words])[" ".join(words)]
    assert status == 0, out
    result = subprocess.run(
        [sys.executable, "-c", DEEP], capture_output=True, text=True, check=False, cwd=here
    )
    assert (result.returncode, result.stderr) == (0, ""), result.stderr[-500:]


def test_many_small_files_that_make_too_much_code_are_refused(here):
    make(here / "pkg", {"msg/Big.msg": numbered("int8 f@", 15_000)})
    make(here / "pkg", {f"msg/M{number}.msg": "Big x\n" for number in range(150)})
    out = io.StringIO()
    with contextlib.redirect_stderr(out):
        assert main(["gen", "pkg", "-o", "out/pkg"]) == 2
    assert "`pkg` has 2,265,150 fields" in out.getvalue()


def test_deep_folders(here):
    folder = here
    for _ in range(300):
        folder = folder / "a"
    make(folder, {A: "int8 x\n"})
    out = io.StringIO()
    with contextlib.redirect_stdout(out):
        assert main(["check", "."]) == 0
    assert "1 file" in out.getvalue()
