"""The catalogue of each distribution, and what is read, linked and compared for one or several."""

import json
import re
from collections import Counter
from hashlib import sha256
from pathlib import Path

import click
import pytest

import idlc
from idlc.check.registry import advise
from idlc.cli.check import check_command as check
from idlc.cli.main import main
from idlc.cli.run import completion
from idlc.compiler.compiler import compile_package, derived_names
from idlc.diagnostics.report import Report
from idlc.diagnostics.source import Source
from idlc.language.format import format_file
from idlc.language.parse import parse
from idlc.model import catalog, ir
from idlc.model.distros import BY_NAME, DISTROS, NEWEST
from idlc.model.ir import meaning
from idlc.model.link import link
from idlc.model.lowering.lower import lower
from idlc.project import step
from idlc.project.library import Library
from idlc.project.root import Root
from tests.support.paths import SPEC

HASHES = json.loads((SPEC / "distro_hashes.json").read_text("utf-8"))
PACKAGES = json.loads((SPEC / "distro_packages.json").read_text("utf-8"))
OTHERS = json.loads((SPEC / "other_interfaces.json").read_text("utf-8"))
UNCONFIRMED = HASHES.pop("unconfirmed")
ROSIDL = {
    "humble": "3.1.9",
    "iron": "4.0.1",
    "jazzy": "4.6.9",
    "kilted": "4.9.8",
    "lyrical": "5.2.1",
    "rolling": "5.3.1",
}


@pytest.fixture(autouse=True)
def _nothing_is_installed(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / ".git").mkdir()
    monkeypatch.setattr("idlc.project.prefixes.ament_prefixes", lambda: ())
    monkeypatch.delenv("ROS_DISTRO", raising=False)


@pytest.fixture
def install(tmp_path_factory, monkeypatch):
    """Return a function that installs a distribution with some interfaces, and where that is."""
    prefix = tmp_path_factory.mktemp("prefix")

    def make(distro: str, files: dict[str, str]) -> Path:
        telling = "<package><name>rosidl_runtime_c</name><version>{}</version></package>"
        files = {"rosidl_runtime_c/package.xml": telling.format(ROSIDL[distro]), **files}
        for path, text in files.items():
            (prefix / "share" / path).parent.mkdir(parents=True, exist_ok=True)
            (prefix / "share" / path).write_text(text, encoding="utf-8")
        monkeypatch.setattr("idlc.project.prefixes.ament_prefixes", lambda: (prefix,))
        return prefix

    return make


def write(files: dict[str, str]) -> None:
    for path, text in files.items():
        Path(path).parent.mkdir(parents=True, exist_ok=True)
        Path(path).write_text(text, encoding="utf-8")


def said(capsys, *words: str) -> list[dict[str, object]]:
    """Return what a command says as JSON, problem by problem."""
    main([*words, "--format", "json"])
    lines = map(json.loads, capsys.readouterr().out.splitlines())
    return [line for line in lines if line["type"] == "diagnostic"]


# the catalogue


class WithOthers(Library):
    """The catalogue of a distribution, and what it leaves out."""

    def source(self, name):
        lines = OTHERS.get(str(name))
        if lines is None:
            return super().source(name)
        return Source(str(name), "".join(f"{line}\n" for line in lines))


@pytest.mark.parametrize("distro", ["jazzy", "kilted", "lyrical"])
def test_hashes_are_those_that_are_known(distro):
    known = {
        name: value
        for distros, hashes in HASHES.items()
        if distro in distros.split()
        for name, value in hashes.items()
    }
    library = WithOthers([], Root.here(), Report(), distro=BY_NAME[distro])
    found = {}
    names = {*map(str, catalog.interfaces(BY_NAME[distro])), *(known.keys() & OTHERS.keys())}
    for name in map(ir.TypeName.parse, names):
        report = Report()
        model = compile_package(name.package, [(name, library.source(name))], library, report)
        assert list(report) == []
        for part in derived_names(model.interfaces[name]):
            found[part] = model.describer.hash(part)
    assert len(found) > 390
    assert found == known


#: Not in the versions of `distro_packages.json`, or a file of another package.
NOT_RELEASED = {"geometry_msgs/msg/VelocityWithCovarianceStamped", "test_msgs/msg/BasicTypes"}


@pytest.mark.parametrize("distro", DISTROS, ids=lambda one: one.name)
def test_definitions_are_those_of_the_release_repositories(distro):
    """Hashes say nothing of constants and defaults."""
    texts = {name: catalog.source(name, distro).text for name in catalog.interfaces(distro)}
    for package, (version, expected) in PACKAGES[distro.name].items():
        names = [n for n in texts if n.package == package and str(n) not in NOT_RELEASED]
        lines = "".join(f"{name} {step.meaning(texts[name], package)}\n" for name in names)
        assert sha256(lines.encode()).hexdigest() == expected, (package, version)
    assert PACKAGES[distro.name].keys() == set(catalog.packages(distro))


def test_unconfirmed_hashes_are_marked():
    """Of the rest, every one was seen in a wheel, or belongs to an interface that was."""
    recorded = json.loads((SPEC / "catalog_hashes.json").read_text("utf-8"))
    marked = Counter(name for names in UNCONFIRMED.values() for name in names)
    for distros, names in UNCONFIRMED.items():
        assert set(names) <= HASHES[distros].keys()
    for hashes in HASHES.values():
        assert {name for name, value in hashes.items() if recorded.get(name, value) != value} <= (
            marked.keys()
        )
    assert "nav_msgs/msg/Trajectory" in marked
    assert len(marked) == 12


@pytest.mark.parametrize("distro", DISTROS, ids=lambda one: one.name)
def test_every_catalogue_is_whole(distro):
    library = Library([], Root.here(), Report(), distro=distro)
    names = catalog.interfaces(distro)
    assert list(names) == sorted(set(names))
    for name in names:
        report = Report()
        source = catalog.source(name, distro)
        own = lower(parse(source), name, report, distro)
        link(name.package, [own], library, report)
        assert list(report) == []
        assert name.package in catalog.packages(distro)


def test_a_definition_stands_once_for_each_distribution():
    folder = Path(catalog.__file__).parent
    common = json.loads((folder / "catalog.json").read_text("utf-8"))
    differences = json.loads((folder / "catalog_differences.json").read_text("utf-8"))
    assert common.keys() & differences.keys() == set()
    for name, variants in differences.items():
        words = [word for distros in variants for word in distros.split()]
        assert len(words) == len(set(words)), name
        assert set(words) <= BY_NAME.keys()
        texts = [json.dumps(one) for one in variants.values()]
        assert len(texts) == len(set(texts)), name
        assert len(variants) > 1 or len(words) < len(DISTROS), name


def test_what_distributions_have():
    has = {distro.name: {str(name) for name in catalog.interfaces(distro)} for distro in DISTROS}
    assert "nav_msgs/msg/Goals" in has["jazzy"] & has["humble"]
    assert "geometry_msgs/msg/VelocityWithCovarianceStamped" in has["jazzy"]
    assert {f"rosgraph_msgs/msg/{one}" for one in ("Clock", "Graph", "TypeHash")} <= has["kilted"]
    assert not any(name.startswith("service_msgs/") for name in has["humble"])
    assert "geometry_msgs/msg/Pose2D" in has["kilted"] - has["lyrical"]
    assert "nav_msgs/msg/Trajectory" in has["lyrical"] & has["jazzy"] - has["humble"]
    assert len(has["jazzy"]) == 235


def test_removed_and_changed():
    def name(text):
        return ir.TypeName.parse(text)

    pose, event = name("geometry_msgs/msg/Pose2D"), name("lifecycle_msgs/msg/TransitionEvent")
    spread = name("sensor_msgs/msg/Range")
    for distro in DISTROS:
        newer = distro.name in ("lyrical", "rolling")
        expected = None if newer else BY_NAME["lyrical"]
        assert catalog.removed(pose, distro) == expected
        assert catalog.changed(event, distro) == expected
        assert catalog.changed(spread, distro) == (
            BY_NAME["iron"] if distro.name == "humble" else None
        )
    # Iron lacks what point releases of the others got
    assert catalog.removed(name("nav_msgs/msg/Goals"), BY_NAME["humble"]) is None
    assert catalog.changed(name("demo/msg/Goals"), BY_NAME["humble"]) is None


# which distribution


def built_in_range(capsys, *words: str) -> bool:
    assert main(["show", "sensor_msgs/msg/Range", *words]) == 0
    return "variance" in capsys.readouterr().out


def test_the_default_is_what_is_installed(install, capsys, monkeypatch):
    assert built_in_range(capsys)
    monkeypatch.setenv("ROS_DISTRO", "humble")
    assert not built_in_range(capsys)
    monkeypatch.delenv("ROS_DISTRO")
    install("humble", {})
    assert not built_in_range(capsys)
    write({"pyproject.toml": '[tool.idlc]\ndistro = "iron"\n'})
    assert built_in_range(capsys)
    assert not built_in_range(capsys, "--distro", "humble")


def test_a_release_that_is_not_known_counts_as_the_default(install, capsys, monkeypatch):
    monkeypatch.setitem(ROSIDL, "humble", "9.9.9")
    install("humble", {})
    assert built_in_range(capsys)


def test_an_installed_definition_wins_if_it_is_of_that_distribution(install, capsys):
    text = "int32 mine\n"
    install("jazzy", {"sensor_msgs/msg/Range.msg": text, "my_msgs/msg/Mine.msg": text})
    main(["show", "sensor_msgs/msg/Range"])
    assert "int32 mine" in capsys.readouterr().out
    main(["show", "sensor_msgs/msg/Range", "--distro", "kilted"])
    assert "float32 variance" in capsys.readouterr().out
    assert main(["show", "my_msgs/msg/Mine", "--distro", "kilted"]) == 0
    capsys.readouterr()
    assert main(["list", "sensor_msgs", "--distro", "kilted"]) == 0
    assert "sensor_msgs/msg/Imu" in capsys.readouterr().out
    assert main(["list", "--distro", "kilted"]) == 0
    assert re.search(r"(?m)^sensor_msgs .*built in$", capsys.readouterr().out)


def test_shells_offer_names():
    offered = completion.distros(click.Context(check), click.Option(["--distro"]), "humble,l")
    assert offered == ["humble,lyrical"]


def test_what_was_removed_is_not_taken_from_another_distribution(install, capsys):
    prefix = install("jazzy", {"actionlib_msgs/msg/GoalID.msg": "string id\n"})
    write({"demo/msg/A.msg": "actionlib_msgs/GoalID a\n"})
    assert [one["code"] for one in said(capsys, "check", "demo")] == ["IDL424"]
    (found,) = said(capsys, "check", "demo", "--distro", "lyrical")
    assert (found["code"], "Kilted" in found["hint"]) == ("IDL202", True)
    assert main(["check", "demo", "--distro", "lyrical", "-I", str(prefix)]) == 0


def test_several_in_settings(capsys):
    write(
        {
            "pyproject.toml": '[tool.idlc]\ndistro = ["humble", "lyrical"]\n',
            "demo/msg/A.msg": "geometry_msgs/Pose2D a\nnav_msgs/Trajectory b\n",
        }
    )
    found = said(capsys, "check", "demo")
    assert [(one["code"], one["distros"]) for one in found] == [
        ("IDL201", ["lyrical"]),
        ("IDL201", ["humble"]),
    ]
    assert not built_in_range(capsys)


@pytest.mark.parametrize(
    "words", [["gen", "demo", "-o", "out"], ["show", "demo"], ["docs", "demo", "-o", "out"]]
)
def test_one_name_for_all_but_check(words, capsys):
    write({"demo/msg/A.msg": "int32 a\n"})
    assert main([*words, "--distro", "humble,jazzy"]) == 2
    assert "only `idlc check` takes several" in capsys.readouterr().err
    assert main([*words, "--distro", "jazyz"]) == 2
    assert "did you mean `jazzy`?" in capsys.readouterr().err


def test_generated_code_is_the_same_before_lyrical_and_from_then_on(capsys):
    text = "std_msgs/Header header\nfloat64[] a\nstring b\n"
    write({"demo/msg/A.msg": text, "demo/srv/S.srv": "---\n"})
    found = {}
    for distro in BY_NAME:
        assert main(["gen", "demo", "-o", f"out/{distro}/demo", "--distro", distro]) == 0
        files = sorted(Path("out", distro).rglob("*.py"))
        found[distro] = {path.relative_to(f"out/{distro}"): path.read_bytes() for path in files}
    assert len(found["humble"]) > 10
    differing = {name for name in found["jazzy"] if found["jazzy"][name] != found["lyrical"][name]}
    assert differing == {Path("demo/msg/_a.py"), Path("demo/srv/_s.py")}
    for distro, files in found.items():
        assert files == found["lyrical" if BY_NAME[distro].converts_values else "jazzy"]


def test_generating_for_a_distribution_with_other_classes(capsys):
    write({"demo/msg/A.msg": "string[] a\n"})
    for distro, written in (("jazzy", 1), ("kilted", 0), ("lyrical", 1), ("rolling", 0)):
        before = Path("out/demo/msg/_a.py").read_bytes() if Path("out").exists() else b""
        lock = Path("out/demo/idlc.lock").read_bytes() if before else b""
        assert main(["gen", "demo", "-o", "out/demo", "--distro", distro]) == 0
        assert (Path("out/demo/msg/_a.py").read_bytes() != before) == written
        assert (Path("out/demo/idlc.lock").read_bytes() != lock) == written
    capsys.readouterr()
    assert main(["gen", "demo", "-o", "out/demo", "--distro", "lyrical", "--check"]) == 0
    assert main(["gen", "demo", "-o", "out/demo", "--distro", "jazzy", "--check"]) == 1
    assert "idlc wrote it for a different ROS 2 distribution" in capsys.readouterr().err


def test_loaded_classes_are_of_a_distribution():
    write({"demo/msg/A.msg": "string[] a\n"})
    for distro, kind in (("jazzy", tuple), ("lyrical", list), ("jazzy", tuple), ("rolling", list)):
        loaded = idlc.load("demo/msg/A.msg", distro=distro)
        assert type(loaded.A(a=("x",)).a) is kind


def test_generating_again_for_another_distribution_is_no_shortcut(capsys):
    write({"demo/msg/A.msg": "@optional int32 a\n"})
    for distro, status in (("lyrical", 0), ("rolling", 0), ("jazzy", 1), ("lyrical", 0)):
        assert main(["gen", "demo", "-o", "out/demo", "--distro", distro]) == status


def test_services_for_humble_which_has_no_events(capsys):
    write({"demo/srv/S.srv": "---\n", "demo/action/A.action": "---\n---\n"})
    for words in (["check", "demo"], ["gen", "demo", "-o", "out/demo", "--vendor-deps"]):
        assert main([*words, "--distro", "humble"]) == 0, capsys.readouterr().err
    capsys.readouterr()
    assert Path("out/demo/_vendor/service_msgs/msg/_service_event_info.py").is_file()
    for text in ("---\n", "service_msgs/ServiceEventInfo b\n---\n"):
        write({"demo/srv/S.srv": text, "demo/msg/M.msg": "service_msgs/ServiceEventInfo a\n"})
        found = said(capsys, "check", "demo", "--distro", "humble,jazzy")
        assert {one["code"] for one in found} == {"IDL202"}
        assert all(one["distros"] == ["humble"] for one in found)
        assert len(found) == 1 + text.count("b")


def test_documents_are_of_a_distribution(capsys):
    write({"demo/msg/A.msg": "@optional nav_msgs/Trajectory a\n"})
    assert main(["docs", "demo", "-o", "site"]) == 1
    assert main(["docs", "demo", "-o", "site", "--distro", "lyrical"]) == 0


# @optional

LINES = (
    ("@optional int32 a", "int32 a"),
    ("@optionalint32 a", "int32 a"),
    ("@optional\tint32 a 5", "int32 a 5"),
    ("@optional\u00a0int32 a", "int32 a"),
    (
        "# head\n\n@optional  # one\n\n# two\nint32 a  # three",
        "# head\n\n# one\n\n# two\nint32 a  # three",
    ),
    ("int32 b\n  # of b\n@optional int32 a", "int32 b\n  # of b\nint32 a"),
    ("int32 b\n@optional\n  # of b\nint32 a", "int32 b\n  # of b\nint32 a"),
    ("@optional uint8 A=1\nint32 a", "uint8 A=1\nint32 a"),
    ("int32 a\n@optional", "int32 a"),
    ("@optional string a @optional", "string a @optional"),
)


def fields_of(text: str, distro=NEWEST):
    report = Report()
    name = ir.TypeName("demo", "msg", "A")
    return lower(parse(Source("A.msg", text)), name, report, distro), report


def without_places(field: ir.Field) -> tuple[object, ...]:
    return field.name, field.type, field.default, field.comment, field.unit


@pytest.mark.parametrize(("text", "plain"), LINES)
def test_a_file_means_the_same_without_optional(text, plain):
    (given, report), (wanted, _) = fields_of(text), fields_of(plain)
    assert {one.code for one in report} == {"IDL111"}
    assert list(map(without_places, given.fields)) == list(map(without_places, wanted.fields))
    assert given.constants == () or given.constants[0].value == wanted.constants[0].value
    assert given.comment == wanted.comment
    for field in given.fields:
        assert field.name_span.text == field.name
        assert text.startswith(field.type_span.text, field.type_span.start)


@pytest.mark.parametrize(("text", "plain"), LINES)
def test_older_distributions_refuse_it(text, plain):
    for distro in DISTROS:
        _, report = fields_of(text, distro)
        expected = "IDL111" if distro.reads_optional else "IDL112"
        assert {one.code for one in report} == {expected}
        if not distro.reads_optional:
            assert all(distro.title in one.message for one in report)


@pytest.mark.parametrize("text", [*(line for line, _ in LINES), "@optional   int32   a # x\n"])
def test_formatting_keeps_it(text):
    once = format_file(parse(Source("A.msg", text)))
    assert format_file(parse(Source("A.msg", once))) == once
    assert meaning(fields_of(once)[0]) == meaning(fields_of(text)[0])
    assert once.split() == [*re.sub("\u00a0", " ", text).split()]


@pytest.mark.parametrize(
    "text",
    [
        "@optional\n@optional int32 a\n",
        "@optional\n# x\n\n@optional\nint32 a\n",
        "@optional @optional int32 a\n",
        "@optional@optional int32 a\n",
    ],
)
def test_a_second_one_is_refused(text):
    _, report = fields_of(text)
    assert [one.code for one in report] == ["IDL111", "IDL113"]
    assert report.had_errors


def test_sections_are_independent():
    report = Report()
    text = "@optional\n---\n@optional int32 a\nint32 b\n"
    service = lower(parse(Source("S.srv", text)), ir.TypeName("demo", "srv", "S"), report, NEWEST)
    assert {one.code for one in report} == {"IDL111"}
    assert [field.optional for field in service.response.fields] == [True, False]


def test_it_changes_neither_hash_nor_idl(capsys):
    write({"a/demo/msg/A.msg": "@optional int32 a\n", "b/demo/msg/A.msg": "int32 a\n"})
    found = []
    for folder in "ab":
        assert main(["show", f"{folder}/demo", "--format", "hash", "--distro", "lyrical"]) == 0
        found.append(capsys.readouterr().out)
    assert found[0] == found[1]
    main(["show", "a/demo/msg/A.msg", "--format", "ros2idl", "--distro", "lyrical"])
    assert "    @optional\n    int32 a;" in capsys.readouterr().out.replace("      ", "    ")


def test_leaving_it_out_is_what_fix_does(capsys):
    write({"demo/msg/A.msg": "@optional int32 a\n@optional\nint32 b\n"})
    assert main(["check", "demo", "--fix", "--distro", "jazzy,lyrical"]) == 0
    assert Path("demo/msg/A.msg").read_text() == "int32 a\n\nint32 b\n"


# several


def test_advice_for_some_gives_way_to_an_error_for_others(capsys):
    write({"demo/msg/A.msg": "geometry_msgs/Pose2D a  # idlc: ignore[IDL424] for now\n"})
    (found,) = said(capsys, "check", "demo", "--distro", "jazzy,lyrical")
    assert (found["code"], found["distros"]) == ("IDL201", ["lyrical"])
    assert said(capsys, "check", "demo", "--distro", "humble,kilted") == []


def test_problems_of_all_say_nothing_of_distributions(capsys):
    write({"demo/msg/A.msg": "flot64 a\nwstring b\n"})
    found = said(capsys, "check", "demo", "--distro", ",".join(BY_NAME))
    assert [one["code"] for one in found] == ["IDL201", "IDL421"]
    assert not any("distros" in one for one in found)


@pytest.mark.parametrize("style", ["github", "gitlab", "junit", "sarif", "text"])
def test_every_format_says_for_which(style, capsys):
    write({"demo/msg/A.msg": "@optional int32 a\n"})
    words = ["check", "demo", "--distro", "iron,jazzy,lyrical", "--format", style]
    assert main(words) == 1
    assert "for: iron, jazzy" in capsys.readouterr().out


def test_exit_codes_are_as_ever(capsys):
    write({"demo/msg/A.msg": "geometry_msgs/Pose2D a\n"})
    assert main(["check", "demo", "--distro", "humble,jazzy"]) == 0
    assert main(["check", "demo", "--distro", "humble,jazzy", "--strict"]) == 1
    assert main(["check", "demo", "--distro", "humble,lyrical"]) == 1


# against a distribution


def test_the_whole_catalogue_against_another(capsys):
    found = said(capsys, "breaking", "--against", "distro:jazzy", "--distro", "lyrical")
    gone = {one["message"] for one in found if one["code"] == "IDL501"}
    assert len(gone) == 4
    others = {one["path"] for one in found if one["code"] != "IDL501"}
    assert others == {"<lyrical>/lifecycle_msgs/msg/TransitionEvent.msg"}
    assert main(["breaking", "--against", "distro:rolling", "--distro", "lyrical"]) == 0


@pytest.mark.parametrize("distro", DISTROS, ids=lambda one: one.name)
def test_nothing_differs_from_itself(distro, capsys):
    assert main(["breaking", "--against", f"distro:{distro.name}", "--distro", distro.name]) == 0
    assert re.fullmatch(
        r"no breaking changes; compared \d+ interfaces; the versions are the same\n",
        capsys.readouterr().out,
    )


def test_only_what_is_used(capsys):
    write({"demo/msg/A.msg": "sensor_msgs/Range a\nB b\n", "demo/msg/B.msg": "int32 c\n"})
    found = said(capsys, "breaking", "demo", "--against", "distro:humble")
    assert [(one["code"], one["path"]) for one in found] == [
        ("IDL505", "<jazzy>/sensor_msgs/msg/Range.msg"),
        ("IDL515", "demo/msg/A.msg"),
    ]
    assert said(capsys, "breaking", "demo", "--against", "distro:iron") == []


def test_what_one_of_them_lacks_hides_nothing(capsys):
    write({"demo/msg/A.msg": "geometry_msgs/Pose2D a\nlifecycle_msgs/TransitionEvent b\n"})
    found = said(capsys, "breaking", "demo", "--against", "distro:jazzy", "--distro", "lyrical")
    assert {one["code"] for one in found} == {"IDL501", "IDL503", "IDL505", "IDL515"}
    write({"demo/msg/A.msg": "no_such_msgs/Pose2D a\n"})
    assert main(["breaking", "demo", "--against", "distro:jazzy"]) == 1


def test_a_standard_package_itself(capsys):
    write({"sensor_msgs/msg/Range.msg": "std_msgs/Header header\n"})
    found = said(capsys, "breaking", "sensor_msgs", "--against", "distro:jazzy")
    assert {one["path"] for one in found} == {"sensor_msgs/msg/Range.msg"}


def test_settings_can_name_it(capsys):
    write(
        {
            "pyproject.toml": '[tool.idlc]\npaths = ["demo"]\nbreaking.against = "distro:humble"\n',
            "demo/msg/A.msg": "sensor_msgs/Range a\n",
        }
    )
    assert [one["code"] for one in said(capsys, "breaking")] == ["IDL505", "IDL515"]


def test_advice_looks_at_names_of_the_catalogue_alone():
    report, found = Report(), Report()
    name = ir.TypeName("demo", "msg", "A")
    own = lower(parse(Source("A.msg", "Pose2D a\n")), name, report)
    other = lower(parse(Source("Pose2D.msg", "int32 a\n")), name._replace(name="Pose2D"), report)
    advise(link("demo", [own, other], catalog, report), found)
    assert list(report) == []
    assert {one.code for one in found} & {"IDL424", "IDL425"} == set()


# what the other commands make of it


def test_names_are_completed_for_the_distribution():
    context = click.Context(check, info_name="check")
    for distro, offered in (("humble", ["geometry_msgs/Pose2D"]), ("lyrical", [])):
        context.params = {"distro": distro}
        found = completion.types_and_paths(context, check.params[0], "geometry_msgs/Pose2")
        assert [one.value for one in found if one.type == "plain"] == offered


def test_a_new_package_depends_on_what_is_there():
    write({"pyproject.toml": '[tool.idlc]\ndistro = "humble"\n'})
    assert main(["scaffold", "package", "rover_msgs", "--interfaces"]) == 0
    for name in ("package.xml", "CMakeLists.txt"):
        text = Path("rover_msgs", name).read_text("utf-8")
        assert "action_msgs" in text
        assert "service_msgs" not in text


def test_pages_have_no_hash_where_there_is_none():
    write({"demo/msg/A.msg": "int32 a\n"})
    for distro in ("humble", "jazzy"):
        assert main(["docs", "demo", "-o", distro, "--distro", distro]) == 0
        pages = "".join(page.read_text("utf-8") for page in Path(distro).rglob("*.html"))
        assert ("RIHS01_" in pages) == (distro == "jazzy")
