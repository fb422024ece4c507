"""`build-backend = "idlc.backend"`: what its hooks build of a folder, and what they refuse."""

import base64
import hashlib
import json
import os
import re
import shutil
import sys
import tarfile
import zipfile
from email.parser import Parser

import pytest
from packaging.utils import parse_wheel_filename
from setuptools import Distribution

from idlc import backend
from idlc.build import compile_at_build
from idlc.cli.main import main
from idlc.generate.native.platforms import LAYOUTS
from idlc.project import prefixes
from idlc.version import RUNTIME
from tests.support import programs
from tests.support.programs import ended

BUILD = '[build-system]\nrequires = ["idlc"]\nbuild-backend = "idlc.backend"\n'
MANIFEST = """\
<?xml version="1.0"?>
<package format="3">
  <name>demo_msgs</name>
  <version>1.2.3</version>
  <description>How demos talk.</description>
  <maintainer email="ada@example.com">Ada</maintainer>
  <license>MIT</license>
  <buildtool_depend>ament_cmake</buildtool_depend>
  <depend>std_msgs</depend>
  <member_of_group>rosidl_interface_packages</member_of_group>
</package>
"""
FILES = {
    "package.xml": MANIFEST,
    "pyproject.toml": BUILD,
    "CMakeLists.txt": "project(demo_msgs)\n",
    "README.md": "# Demos\n",
    "LICENSE": "Do as you like.\n",
    "msg/Drive.msg": "std_msgs/Header header\nfloat32 speed  # forwards [m/s]\n",
    "srv/Ask.srv": "string what\n---\nbool yes\n",
    "action/Walk.action": "float32 to\n---\nfloat32 at\n---\nfloat32 left\n",
}
PREFIX = {  # what is installed besides classes
    "lib/libdemo_msgs__rosidl_typesupport_cpp.so",
    "lib/libdemo_msgs__rosidl_typesupport_introspection_cpp.so",
    "share/ament_index/resource_index/package_run_dependencies/demo_msgs",
    "share/ament_index/resource_index/packages/demo_msgs",
    "share/ament_index/resource_index/rosidl_interfaces/demo_msgs",
    "share/demo_msgs/package.xml",
    *(
        f"share/demo_msgs/{kind}/{name}.{ending}"
        for kind, name in (("msg", "Drive"), ("srv", "Ask"), ("action", "Walk"))
        for ending in (kind, "idl", "json")
    ),
}


def write(folder, files):
    for path, text in files.items():
        (folder / path).parent.mkdir(parents=True, exist_ok=True)
        (folder / path).write_text(text, encoding="utf-8")
    return folder


@pytest.fixture
def source(tmp_path, monkeypatch):
    """The folder of a package, which is the working folder."""
    folder = write(tmp_path / "demo_msgs", FILES)
    monkeypatch.chdir(folder)
    return folder


@pytest.fixture(autouse=True)
def an_x86_64(monkeypatch):
    monkeypatch.setattr(prefixes, "machine", lambda: "x86_64")


def built(folder, hook=backend.build_wheel, settings=None):
    """Return the archive that a hook wrote into a folder."""
    return folder / hook(str(folder), settings)


def read(wheel):
    """Return the content of each file of a wheel, and its metadata."""
    with zipfile.ZipFile(wheel) as archive:
        files = {name: archive.read(name) for name in archive.namelist()}
    (metadata,) = (text for name, text in files.items() if name.endswith("/METADATA"))
    return files, Parser().parsestr(metadata.decode("utf-8"))


def tree(folder):
    return {path: path.read_bytes() for path in folder.rglob("*") if path.is_file()}


def test_a_wheel_holds_classes_and_what_ros_installs(source, tmp_path):
    before = tree(source)
    wheel = built(tmp_path)
    assert tree(source) == before, "nothing is written into the source folder"
    assert wheel.name.startswith("demo_msgs-1.2.3-py3-none-")
    assert not wheel.name.endswith("-any.whl")
    files, metadata = read(wheel)
    data = "demo_msgs-1.2.3.data/data/"
    prefix = {name.removeprefix(data): files[name] for name in files if name.startswith(data)}
    assert set(prefix) == PREFIX
    for path in ("package.xml", "msg/Drive.msg", "srv/Ask.srv", "action/Walk.action"):
        assert prefix[f"share/demo_msgs/{path}"] == before[source / path]
    listed = prefix["share/ament_index/resource_index/rosidl_interfaces/demo_msgs"].decode()
    assert {f"share/demo_msgs/{one}" for one in listed.split()} == {
        path for path in PREFIX if path.endswith((".idl", ".msg", ".srv", ".action"))
    }
    code = "from demo_msgs.msg import Drive; print(Drive(speed=1.5).serialize().hex())"
    status, said = ended(
        sys.executable, "-c", code, cwd=tmp_path, environment={"PYTHONPATH": str(wheel)}
    )
    assert status == 0, said
    assert metadata.get_all("Requires-Dist") == ["numpy"]
    assert metadata.get_payload() == "# Demos\n"
    record = files["demo_msgs-1.2.3.dist-info/RECORD"].decode().splitlines()
    digests = dict(line.split(",")[:2] for line in record)
    assert digests.keys() == files.keys()
    for name, content in files.items():
        if not name.endswith("/RECORD"):
            digest = base64.urlsafe_b64encode(hashlib.sha256(content).digest()).rstrip(b"=")
            assert digests[name] == f"sha256={digest.decode()}"


def test_a_wheel_can_come_with_the_types_that_it_uses(source, tmp_path):
    write(source, {"pyproject.toml": BUILD + "[tool.idlc]\nvendor-deps = true\n"})
    site = tmp_path / "site"
    programs.run(sys.executable, "-m", "zipfile", "-e", built(tmp_path), site, cwd=tmp_path)
    assert (site / "demo_msgs/_vendor/std_msgs/msg/_header.py").exists()
    code = f"import sys; sys.path.insert(0, {str(site)!r}); from demo_msgs.msg import Drive; "
    code += "from demo_msgs.vendor.std_msgs.msg import Header; Drive(header=Header()).serialize()"
    programs.run(sys.executable, "-I", "-S", "-c", code, cwd=tmp_path)


def test_committed_classes_are_compiled_anew(source, tmp_path):
    wheel = built(tmp_path).read_bytes()
    assert main(["gen", ".", "-o", "demo_msgs"]) == 0
    assert built(tmp_path).read_bytes() == wheel
    (source / "demo_msgs" / "msg" / "_drive.py").write_text("edited\n")
    assert built(tmp_path).read_bytes() == wheel


def test_an_editable_wheel_is_like_any(source, tmp_path):
    wheel, editable = tmp_path / "wheel", tmp_path / "editable"
    assert built(wheel).read_bytes() == built(editable, backend.build_editable).read_bytes()


def test_the_same_files_give_the_same_bytes(source, tmp_path, monkeypatch):
    hooks = (backend.build_wheel, backend.build_sdist)
    first = [built(tmp_path / "one", hook).read_bytes() for hook in hooks]
    other = shutil.copytree(source, tmp_path / "of" / "another" / "name")
    for path in other.rglob("*"):
        os.utime(path, (1_000_000_000, 1_000_000_000))
    (other / "msg" / "Drive.msg").chmod(0o600)
    monkeypatch.chdir(other)
    monkeypatch.setenv("TMPDIR", str(tmp_path / "of"))
    assert [built(tmp_path / "two", hook).read_bytes() for hook in hooks] == first
    monkeypatch.setenv("SOURCE_DATE_EPOCH", "1700000000")
    dated = [built(tmp_path / "three", hook) for hook in hooks]
    assert [path.read_bytes() for path in dated] != first
    with zipfile.ZipFile(dated[0]) as wheel:
        assert {one.date_time for one in wheel.infolist()} == {(2023, 11, 14, 22, 13, 20)}


def test_the_source_archive_builds_the_same_wheel(source, tmp_path, monkeypatch):
    wheel = built(tmp_path).read_bytes()
    # what colcon and git left is no source, also where git ignores what is
    write(
        source,
        {
            ".gitignore": "msg/\n*.srv\n",
            "build/demo_msgs/msg/Drive.msg": "int8 old\n",
            "install/demo_msgs/share/demo_msgs/msg/Drive.msg": "int8 old\n",
            "log/latest": "",
        },
    )
    assert built(tmp_path).read_bytes() == wheel
    archive = built(tmp_path / "sdist", backend.build_sdist)
    assert archive.name == "demo_msgs-1.2.3.tar.gz"
    with tarfile.open(archive) as file:
        names = {name.removeprefix("demo_msgs-1.2.3/") for name in file.getnames()}
        file.extractall(tmp_path / "unpacked")  # noqa: S202 - it is our own
    assert names == {*FILES, "PKG-INFO", ".gitignore"}
    monkeypatch.chdir(tmp_path / "unpacked" / "demo_msgs-1.2.3")
    assert built(tmp_path / "again").read_bytes() == wheel


@pytest.mark.skipif(os.name == "nt", reason="links need a right of their own")
def test_a_source_distribution_holds_nothing_from_outside(source, tmp_path, capsys):
    write(tmp_path, {"outside/secret.txt": "secret", "outside/Out.msg": "int8 secret\n"})
    write(source, {"kept/here.txt": "here"})
    for name, target in {
        "extra": "../outside",
        "whole": "/",
        "note.txt": "../outside/secret.txt",
        "NOTICE": str(tmp_path / "outside/secret.txt"),
        "msg/Out.msg": "../../outside/Out.msg",
        "action/by": "../extra",
        "kept/again.txt": "here.txt",
        "circle": ".",
        "nowhere": "gone",
        "loop": "loop",
    }.items():
        (source / name).symlink_to(target)
    with tarfile.open(built(tmp_path, backend.build_sdist)) as sdist:
        names = {name.removeprefix("demo_msgs-1.2.3/") for name in sdist.getnames()}
        contents = [sdist.extractfile(one).read() for one in sdist if one.isfile()]
    assert not any(b"secret" in one for one in contents)
    assert names >= {*FILES, "kept/again.txt"}
    assert not names & {"NOTICE", "note.txt", "msg/Out.msg"}
    said = capsys.readouterr().err
    assert "skipped, because they lead out of the project: `NOTICE`, `action/by`, `extra`" in said


def test_hooks_of_hatchling_are_not_run(source, tmp_path):
    settings = "".join(
        f'[tool.hatch.{table}.hooks.custom]\npath = "hook.py"\n'
        for table in ("build", "build.targets.sdist", "build.targets.wheel", "metadata")
    )
    mark = f"open({str(tmp_path / 'ran')!r}, 'w')\n"
    hooks = dict.fromkeys(("hook.py", "hatch_build.py", "setup.py", "hatchling.py"), mark)
    write(source, {"pyproject.toml": BUILD + settings, **hooks})
    built(tmp_path / "wheels")
    built(tmp_path / "sdists", backend.build_sdist)
    assert not (tmp_path / "ran").exists()


def changed(old, new=""):
    assert old in MANIFEST
    return {"package.xml": MANIFEST.replace(old, new)}


def added(*lines):
    return changed("</package>", "\n".join([*lines, "</package>"]))


def project(*lines):
    return {"pyproject.toml": "\n".join([BUILD, "[project]", *lines, ""])}


TOLD = {
    "": {
        "Name": ["demo_msgs"],
        "Version": ["1.2.3"],
        "Summary": ["How demos talk."],
        "Maintainer-email": ["Ada <ada@example.com>"],
        "License-Expression": ["MIT"],
        "License-File": ["LICENSE"],
        "Requires-Python": [">=3.10"],
        "Author": None,
    },
    "several licences": {"License-Expression": ["MIT AND (Apache-2.0 OR Zlib)"], "License": None},
    "loose licences": {"License": ["MIT, BSD"], "License-Expression": None},
    "people": {
        "Author": ["Ünal & Çelik, B"],
        "Author-email": ['"Ö, Åke" <ake@example.com>, c@example.com'],
    },
    "description": {"Summary": ["How demos talk. Requires-Dist: evil <x>"]},
    "addresses": {"Project-URL": ["Homepage, https://a.org", "Issues, https://i.org"]},
    "its own": {
        "Name": ["acme-demo"],
        "Version": ["7"],
        "Summary": None,
        "Requires-Dist": ["acme-base"],
        "License-Expression": None,
    },
    "a runtime that is installed": {"Requires-Dist": [RUNTIME, "numpy"]},
    "partly": {
        "Name": ["acme-demo"],
        "Version": ["1.2.3"],
        "Summary": ["Mine."],
        "Requires-Dist": ["numpy"],
        "License-Expression": ["MIT"],
        "Maintainer-email": None,
    },
}
CHANGED = {
    "": {},
    "a runtime that is installed": {
        "pyproject.toml": BUILD + '[tool.idlc]\nruntime = "installed"\n'
    },
    "several licences": added("<license>Apache-2.0 OR Zlib</license>"),
    "loose licences": added("<license>BSD</license>"),
    "people": added(
        '<author email="ünal@example.com">Ünal\n &amp; Çelik</author>',
        '<author email="nowhere">B</author>',
        '<author email="ake@example.com">Ö, Åke</author>',
        '<author email="c@example.com"/>',
        "<author/>",
    ),
    "description": changed(
        "How demos talk.", "How <b>demos</b>\n talk.\nRequires-Dist: evil\n&lt;x&gt;"
    ),
    "addresses": added(
        "<url>https://a.org</url>",
        '<url type="website">https://b.org</url>',
        '<url type="repository">a\nb</url>',
        '<url type="bugtracker">https://i.org</url>',
        '<url type="odd">https://o.org</url>',
    ),
    "its own": project('name = "acme-demo"', 'version = "7"', 'dependencies = ["acme-base"]'),
    "partly": project(
        'name = "acme-demo"',
        'description = "Mine."',
        'dynamic = ["version", "license", "dependencies", "authors"]',
    ),
}


@pytest.mark.parametrize("case", TOLD)
def test_metadata_is_what_the_package_declares(case, source, tmp_path):
    write(source, CHANGED[case])
    _, metadata = read(built(tmp_path))
    for field, values in TOLD[case].items():
        assert metadata.get_all(field) == values, field
    name = TOLD[case].get("Name", ["demo_msgs"])[0].replace("-", "_")
    with tarfile.open(built(tmp_path, backend.build_sdist)) as sdist:
        (top,) = {member.partition("/")[0] for member in sdist.getnames()}
    assert top == f"{name}-{metadata['Version']}"


def test_a_wheel_whose_project_does_not_require_the_runtime_is_reported(source, tmp_path, capsys):
    settings = BUILD + '[tool.idlc]\nruntime = "installed"\n'
    project = '[project]\nname = "demo_msgs"\nversion = "1"\ndependencies = [{}]\n'
    write(source, {"pyproject.toml": settings + project.format('"numpy"')})
    names, _ = read(built(tmp_path))
    assert "demo_msgs/_idlc.py" in names
    assert not [name for name in names if name.startswith("demo_msgs/_idlc/")]
    said = capsys.readouterr().err
    assert "IDL459" in said
    assert f'add "{RUNTIME}" to `dependencies`' in said
    write(source, {"pyproject.toml": settings + project.format(f'"numpy", "{RUNTIME}"')})
    built(tmp_path)
    assert "IDL459" not in capsys.readouterr().err


REFUSED = {
    "no package.xml": ({"package.xml": None}, "IDL602"),
    "no XML": ({"package.xml": "\0"}, "IDL610"),
    "no name": (changed("<name>demo_msgs</name>"), "IDL610"),
    "a name that leaves the folder": (changed("demo_msgs", "../evil"), "IDL607"),
    "an absolute name": (changed("demo_msgs", "/etc/evil"), "IDL607"),
    "a name of Python's": (changed("demo_msgs", "numpy"), "IDL607"),
    "no version": (changed("<version>1.2.3</version>"), "IDL610"),
    "no version of ROS 2": (changed("1.2.3", "1.2.3rc1"), "package.xml:4:3"),
    "an entity bomb": (
        {
            "package.xml": MANIFEST.replace(
                "<package ",
                '<!DOCTYPE p [<!ENTITY a0 "aaaaaaaaaaaaaaaa">'
                + "".join(f'<!ENTITY a{i + 1} "{f"&a{i};" * 16}">' for i in range(8))
                + "]>\n<package ",
            ).replace("How", "&a8;")
        },
        "IDL610",
    ),
    "no TOML": ({"pyproject.toml": BUILD + "[project\n"}, "pyproject.toml:4:9"),
    "a wrong setting": ({"pyproject.toml": BUILD + "[tool.idlc]\nx = 1\n"}, "unknown setting `x`"),
    "a setting of `idlc gen` alone": (
        {"pyproject.toml": BUILD + '[tool.idlc]\nvendor-deps = "beside"\n'},
        "pyproject.toml:5:1",
    ),
    "modules that the wheel would not have": (
        {"demo_msgs/node.py": "print()\n"},
        "but this folder contains `demo_msgs/node.py`",
    ),
    "another name than in package.xml": (
        {"pyproject.toml": BUILD + '[tool.idlc]\npackage = "other"\n'},
        "pyproject.toml:5:1",
    ),
    "no table": ({"pyproject.toml": "project = 3\n" + BUILD}, "must be a table"),
    "no project name": (project('version = "1"'), "project.name"),
    "a wrong project name": (project('name = "a b"', 'version = "1"'), "IDL611"),
    "a version as a number": (project('name = "a"', "version = 1"), "project.version"),
    "dynamic entry points": (project('name = "a"', 'dynamic = ["scripts"]'), "`scripts`"),
    "dynamic is a word": (project('name = "a"', 'dynamic = "version"'), "IDL611"),
    "static and dynamic": (project('name = "a"', 'version = "1"', 'dynamic = ["version"]'), "both"),
    "no such readme": (project('name = "a"', 'version = "1"', 'readme = "no.md"'), "no.md"),
    "no interfaces": (dict.fromkeys(path for path in FILES if path[-4:] != ".xml"), "IDL606"),
    "a wrong interface": ({"msg/Drive.msg": "flot32 speed\n"}, "unknown type `flot32`"),
    "several packages": (
        {"other/package.xml": MANIFEST.replace("demo", "o"), "other/msg/O.msg": "int8 o\n"},
        "IDL608",
    ),
    "another package": (
        {
            **dict.fromkeys(path for path in FILES if path[:4] in ("msg/", "srv/", "acti")),
            "other/package.xml": MANIFEST.replace("demo", "o"),
            "other/msg/O.msg": "int8 o\n",
        },
        "IDL608",
    ),
}


@pytest.mark.parametrize("case", REFUSED)
def test_what_is_wrong_ends_the_build_with_a_report(case, source, tmp_path, capfd):
    files, expected = REFUSED[case]
    write(source, {path: text for path, text in files.items() if text is not None})
    for path, text in files.items():
        if text is None:
            (source / path).unlink()
    before = tree(tmp_path)
    with pytest.raises(SystemExit) as ending:
        built(tmp_path)
    assert ending.value.code in (1, 2)
    said = capfd.readouterr().err
    assert expected in said
    assert said.endswith("idlc: nothing was built, see above\n")
    assert tree(tmp_path) == before


def test_what_cannot_be_written_is_said(source, tmp_path, capfd):
    (tmp_path / "file").write_text("")
    with pytest.raises(SystemExit):
        backend.build_wheel(str(tmp_path / "file" / "dist"))
    assert "error[IDL612]: cannot write the archive: " in capfd.readouterr().err


def test_the_builder_may_be_missing(source, tmp_path, capfd, monkeypatch):
    assert backend.get_requires_for_build_editable() == [backend.BUILDER]
    monkeypatch.setitem(sys.modules, "hatchling", None)
    monkeypatch.setattr("importlib.util.find_spec", lambda _: None)
    with pytest.raises(SystemExit):
        built(tmp_path)
    assert "pip install hatchling" in capfd.readouterr().err


@pytest.mark.parametrize("settings", [None, {"libraries": "no", "distro": "jazzy"}])
def test_without_a_library_a_package_is_not_registered(
    settings, source, tmp_path, capfd, monkeypatch
):
    if settings is None:
        monkeypatch.setattr(prefixes, "machine", lambda: "")
    wheel = built(tmp_path, settings=settings)
    assert wheel.name == "demo_msgs-1.2.3-py3-none-any.whl"
    files, _ = read(wheel)
    data = "demo_msgs-1.2.3.data/data/"
    kept = {path for path in PREFIX if "/packages/" not in path and "/rosidl_int" not in path}
    assert {name.removeprefix(data) for name in files if name.startswith(data)} == {
        path for path in kept if not path.startswith("lib/")
    }
    assert "recorders stop at a package without a library" in capfd.readouterr().err


def test_wheels_that_differ_have_different_names_and_a_platform_tag_of_pypi(
    source, tmp_path, monkeypatch
):
    """They are for one folder: no build replaces a wheel that holds other libraries."""
    wheels = {}
    for distro in LAYOUTS:
        path = built(tmp_path / "dist", settings={"distro": distro})
        assert wheels.setdefault(path.name, path.read_bytes()) == path.read_bytes()
    built(tmp_path / "dist", settings={"libraries": "no"})
    names = {path.name for path in (tmp_path / "dist").iterdir()}
    assert len(wheels) == len(LAYOUTS)
    monkeypatch.setenv("ROS_DISTRO", "humble")
    monkeypatch.setattr(prefixes, "ament_prefixes", tuple)
    assert built(tmp_path / "dist").name in names, "it is the same as with distro=humble"
    pure = built(tmp_path / "pure", settings={"libraries": "no"})
    assert pure.name == "demo_msgs-1.2.3-1humble-py3-none-any.whl"
    assert names == {*wheels, "demo_msgs-1.2.3-py3-none-any.whl"}
    parsed = [parse_wheel_filename(name) for name in sorted(names)]
    assert [build for _, _, build, _ in parsed if build] == [
        (1, name) for name in sorted(LAYOUTS) if name != "jazzy"
    ]
    for _, _, _, tags in parsed:
        (tag,) = tags
        assert re.fullmatch(r"any|(manylinux_2_17|musllinux_1_1)_x86_64", tag.platform)
    for name, content in wheels.items():
        assert (tmp_path / "dist" / name).read_bytes() == content
        build, (tag,) = parse_wheel_filename(name)[2:]
        files, _ = read(tmp_path / "dist" / name)
        inside = Parser().parsestr(files["demo_msgs-1.2.3.dist-info/WHEEL"].decode())
        assert inside["Build"] == (f"{build[0]}{build[1]}" if build else None)
        assert [str(tag)] == inside.get_all("Tag")


@pytest.mark.parametrize("hook", [backend.build_wheel, backend.build_sdist])
def test_settings_of_frontends_are_checked(hook, source, tmp_path, capfd):
    for settings, expected in (
        ({"distr": "jazzy"}, "did you mean `distro`?"),
        ({"foo": "bar"}, "the settings are distro, libraries"),
        ({"--build-option": ["--x"]}, "unknown setting `--build-option`"),
        ({"libraries": "nope"}, "use yes, no"),
        ({"libraries": False}, "use yes, no"),
    ):
        with pytest.raises(SystemExit):
            hook(str(tmp_path / "dist"), settings)
        assert expected in capfd.readouterr().err
    assert not (tmp_path / "dist").exists()


def test_the_distribution_can_be_told(source, tmp_path, capfd):
    wheels = {
        distro: built(tmp_path, settings={"distro": distro})
        for distro in ("humble", "jazzy", "kilted", "lyrical")
    }
    assert len({wheel.name for wheel in wheels.values()}) == len(wheels)
    libraries = {
        distro: [content for name, content in read(wheel)[0].items() if name.endswith(".so")]
        for distro, wheel in wheels.items()
    }
    assert libraries["humble"] != libraries["jazzy"] != libraries["lyrical"] != libraries["humble"]
    for unknown in ("foxy", "", ["humble", "jazzy"], True):
        with pytest.raises(SystemExit):
            built(tmp_path, settings={"distro": unknown})
        assert "which idlc does not support" in capfd.readouterr().err


def test_a_package_may_refer_to_others_and_leave_files_out(source, tmp_path):
    write(
        source.parent,
        {
            "base/package.xml": MANIFEST.replace("demo_msgs", "base_msgs"),
            "base/msg/Base.msg": "int8 b\n",
            "demo_msgs/msg/Drive.msg": "base_msgs/Base base\n",
            "demo_msgs/old/msg/Drive.msg": "int8 old\n",
            "demo_msgs/pyproject.toml": f'{BUILD}[tool.idlc]\ninclude = [".."]\nexclude = ["old"]\n'
            'out = "elsewhere"\n',
        },
    )
    files, _ = read(built(tmp_path))
    described = json.loads(files["demo_msgs-1.2.3.data/data/share/demo_msgs/msg/Drive.json"])
    assert [one["type_name"] for one in described["type_hashes"]] == [
        "demo_msgs/msg/Drive",
        "base_msgs/msg/Base",
    ]
    assert b"from base_msgs.msg import Base" in files["demo_msgs/msg/_drive.py"]
    assert not any(name.startswith("base_msgs/") for name in files)


def compiled(_):
    """Build as setup.py of demo_msgs in the working folder does."""
    distribution = Distribution({"name": "demo_msgs"})
    distribution.commands = []
    compile_at_build(distribution, "idlc_interfaces", True)
    distribution.run_commands()


@pytest.mark.parametrize("build", [built, compiled])
def test_a_build_says_why_a_folder_of_packages_is_absent(
    build, source, tmp_path, capfd, monkeypatch
):
    write(source, {"pyproject.toml": f'{BUILD}[tool.idlc]\ninclude = ["../far"]\n'})
    monkeypatch.setattr("sys.argv", ["setup.py", "build"])
    with pytest.raises(SystemExit):
        build(tmp_path / "dist")
    said = capfd.readouterr().err
    assert "error[IDL602]: no such folder: `../far`" in said
    assert "hint: correct `include` in [tool.idlc] of pyproject.toml; source distrib" in said
    assert "`python -m build --wheel`" in said
    assert "-I " not in said
    assert main(["check", "--package", "demo_msgs", "."]) == 2
    assert "hint: correct `-I`, or `include` in [tool.idlc]" in capfd.readouterr().out


@pytest.mark.parametrize("package", ["far_msgs", "near_msgs"])
@pytest.mark.parametrize("build", [built, compiled])
def test_a_build_says_where_to_name_folders_of_packages(
    build, package, source, tmp_path, capfd, monkeypatch
):
    write(tmp_path / "near_msgs", {"package.xml": "<package/>", "msg/A.msg": "bool a\n"})
    write(source, {"msg/Drive.msg": f"{package}/A a\n", "setup.py": ""})
    monkeypatch.setattr("sys.argv", ["setup.py", "build"])
    with pytest.raises(SystemExit):
        build(tmp_path / "dist")
    said = capfd.readouterr().err
    assert "IDL202" in said
    assert "-I " not in said
    (folder,) = re.findall(r"add `(.*)` to `include` in \[tool.idlc\] of pyproject.toml", said)
    if package == "near_msgs":
        with (source / "pyproject.toml").open("a") as file:
            file.write(f"[tool.idlc]\ninclude = ['{folder}']\n")
        built(tmp_path / "dist")
    # a run from a shell has options
    main(["check", "--package", "demo_msgs", "."])
    assert "of pyproject.toml" not in capfd.readouterr().out
