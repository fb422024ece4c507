"""Every way in which people write setup.py: what is wrong is found, fixed in one go, and builds."""

import re
import shlex
import sys
from pathlib import Path

import pytest

from idlc.cli.main import main
from tests.support.programs import ended, run_with

PLAIN = """\
from setuptools import setup

package_name = 'demo'

setup(
    name=package_name,
    version='0.0.0',
    packages=[package_name],
    data_files=[
        ('share/ament_index/resource_index/packages',
            ['resource/' + package_name]),
        ('share/' + package_name, ['package.xml']),
    ],
    install_requires=['setuptools'],
    zip_safe=True,
    entry_points={
        'console_scripts': [
            'talker = demo.talker:main',
        ],
    },
)
"""
DATA = PLAIN[PLAIN.index("    data_files") : PLAIN.index("    install_requires")]
APPENDED = """\
data_files = [('share/' + package_name, ['package.xml'])]
data_files.append(('share/ament_index/resource_index/packages', ['resource/' + package_name]))

setup("""
#: How people write it; each needs everything that idlc can add.
FIXABLE = {
    "tutorial": PLAIN,
    "double quotes": PLAIN.replace("'", '"'),
    "list of two": PLAIN.replace("[package_name],", "[package_name, 'demo.parts'],"),
    "other package": PLAIN.replace("[package_name],", "[package_name, 'other'],"),
    "find_packages": PLAIN.replace("import setup", "import find_packages, setup").replace(
        "[package_name],", "find_packages(exclude=['test']),"
    ),
    "find one": PLAIN.replace("import setup", "import find_packages, setup").replace(
        "[package_name],", "find_packages(include=[package_name]),"
    ),
    "variables": PLAIN.replace("\nsetup(", "\npackages = [package_name]\nsetup(").replace(
        "packages=[package_name]", "packages=packages"
    ),
    "appended": PLAIN.replace("setup(", APPENDED, 2)
    .replace("import " + APPENDED, "import setup(")
    .replace(DATA, "    data_files=data_files,\n"),
    "joined": PLAIN.replace(
        "from setup", "import os\nfrom glob import glob\nfrom setup", 1
    ).replace(
        "('share/' + package_name, ['package.xml']),",
        "(os.path.join('share', package_name), ['package.xml']),\n"
        "        (os.path.join('share', package_name, 'launch'),\n"
        "            glob(os.path.join('launch', '*launch.[pxy][yma]*'))),",
    ),
    "glob module": "import glob\nimport os\n" + PLAIN,
    "main": PLAIN[: PLAIN.index("setup(\n")]
    + "if __name__ == '__main__':\n"
    + "".join(f"    {line}\n" for line in PLAIN[PLAIN.index("setup(\n") :].splitlines()),
    "one line": "from setuptools import setup\nsetup(name='demo', version='0.0.0', "
    "packages=['demo'], data_files=[('share/ament_index/resource_index/packages', "
    "['resource/demo']), ('share/demo', ['package.xml'])])\n",
    "comments": PLAIN.replace(
        "['package.xml']),\n", "['package.xml'])  # ours, and\n        # ]\n"
    ),
    "tabs": PLAIN.replace("    ", "\t"),
    "CRLF": PLAIN.replace("\n", "\r\n"),
    "BOM": "\ufeff" + PLAIN,
    "not ASCII": PLAIN.replace("    zip_safe", "    author='Žofie', zip_safe"),
    "formatted": PLAIN.replace("'share/' + package_name", "f'share/{package_name}'").replace(
        "'resource/' + package_name", "'resource/%s' % package_name"
    ),
    "sum of texts": PLAIN.replace(
        "'talker = demo.talker:main'", "'talker = ' + package_name + '.talker:main'"
    ),
    "form feed": PLAIN.replace("\npackage_name", "\n\x0cpackage_name"),
}
#: What says nothing that could be judged, or is right already.
CALM = {
    "keywords": "from setuptools import setup\nsetup(name='demo', **load())\n",
    "changed keywords": "from setuptools import setup\nmore = dict(packages=['demo'])\n"
    "more['packages'] += ['demo.msg']\nsetup(name='demo', **more)\n",
    "computed": PLAIN.replace("[package_name],", "packages(),").replace(
        DATA, "    data_files=files(),\n"
    ),
    "loop": PLAIN.replace(
        "setup(\n",
        "data_files = []\nfor kind in ('msg',):\n"
        "    data_files.append(('share/demo/' + kind, glob(kind + '/*')))\nsetup(\n",
    )
    .replace(DATA, "    data_files=data_files,\n")
    .replace("[package_name],", "packages(),"),
}
FILES = {
    "package.xml": '<package format="3">\n  <name>demo</name>\n  <version>0.0.0</version>\n'
    "  <description>x</description>\n  <maintainer email='a@b.cd'>A</maintainer>\n"
    "  <license>MIT</license>\n  <exec_depend>rclpy</exec_depend>\n"
    "  <test_depend>python3-pytest</test_depend>\n"
    "  <export>\n    <build_type>ament_python</build_type>\n  </export>\n</package>\n",
    "setup.cfg": "[install]\ninstall_scripts=$base/lib/demo\n",
    "resource/demo": "",
    "demo/__init__.py": "",
    "demo/talker.py": "def main():\n    pass\n",
    "demo/parts/__init__.py": "",
    "other/__init__.py": "",
    "msg/Wind.msg": "std_msgs/Header header\nfloat32 speed  # [m/s]\n",
    "srv/Ask.srv": "---\nbool known\n",
    "action/Go.action": "---\n---\nfloat32 distance  # [m]\n",
}


@pytest.fixture
def package(tmp_path, monkeypatch):
    """Return a function that writes a package with a setup.py and goes there."""

    def write(setup: str, name: str = "") -> Path:
        folder = tmp_path / "demo"
        for path, text in FILES.items():
            if path == "other/__init__.py" and name != "other package":
                continue
            (folder / path).parent.mkdir(parents=True, exist_ok=True)
            (folder / path).write_text(text)
        (folder / "setup.py").write_bytes(setup.encode())
        monkeypatch.chdir(folder)
        return folder / "setup.py"

    return write


def idlc(capsys, *words: str) -> str:
    main(list(words))
    return "".join(capsys.readouterr())


@pytest.mark.parametrize("name", FIXABLE)
def test_what_is_not_installed_is_found_and_fixed_in_one_go(name, package, capsys):
    path = package(FIXABLE[name], name)
    said = idlc(capsys, "check")
    codes = set(re.findall(r"\[(IDL4[56]\d)\]", said))
    assert codes == {"IDL451", "IDL455", "IDL461", "IDL462"} - (
        {"IDL462"} if name == "find_packages" else set()
    ), said
    assert "the .action, .msg and .srv files and the index entry" in said
    idlc(capsys, "check", "--fix")
    after = path.read_bytes().decode()
    compile(after.removeprefix("\ufeff"), "setup.py", "exec")
    assert idlc(capsys, "check").startswith("no problems"), after
    assert "_idlc" not in after.replace("_idlc_build.py", "")
    assert after.startswith("\ufeff") == FIXABLE[name].startswith("\ufeff")
    assert ("\r\n" in FIXABLE[name]) == ("\n" not in after.replace("\r\n", ""))
    before = [line.strip(" \t,") for line in FIXABLE[name].splitlines()]
    assert len([line for line in before if line in after]) >= len(before) - 3


@pytest.mark.parametrize(
    "arguments", ["name='demo', packages=['demo']", "name='demo'", "packages=['demo'], name='demo'"]
)
def test_what_a_fix_makes_necessary_is_fixed_with_it(arguments, package, capsys):
    path = package(f"from setuptools import setup\n\nsetup({arguments})\n")
    idlc(capsys, "check", "--fix")
    assert idlc(capsys, "check").startswith("no problems"), path.read_text(encoding="utf-8")


@pytest.mark.parametrize("name", CALM)
def test_what_cannot_be_seen_is_not_judged(name, package, capsys):
    package(CALM[name])
    assert set(re.findall(r"\[(IDL45[5-9]|IDL46\d)\]", idlc(capsys, "check"))) <= {"IDL461"}


@pytest.mark.parametrize("name", FIXABLE)
def test_a_new_interface_is_installed_with_the_others(name, package, capsys):
    path = package(FIXABLE[name], name)
    said = idlc(capsys, "scaffold", "interface", "msg", "Rain", "bool falls")
    after = path.read_bytes().decode()
    found = re.findall(r"\[(IDL4(?:5[5-9]|6\d))\]", idlc(capsys, "check"))
    assert not found, (said, after)
    assert "_idlc" not in after.replace("_idlc_build.py", "")


def built(folder: Path, target: Path) -> tuple[int, str]:
    """Install a package with colcon's words; return the status and what was printed."""
    words = "setup.py -q build install --single-version-externally-managed --record r.txt".split()
    places = (f"--install-lib={target}", f"--install-data={target}", f"--prefix={target}")
    return ended(sys.executable, *words, *places, cwd=folder)


WAYS = {
    "fixed": ["check --fix"],
    "scaffolded": ["scaffold interface msg Rain 'bool falls'"],
    "generated": ["gen . -o demo", "check --fix"],
}


@pytest.mark.long
@pytest.mark.parametrize("way", WAYS)
@pytest.mark.parametrize("name", FIXABLE)
def test_what_is_built_has_its_messages(name, way, package, capsys, tmp_path):
    folder = package(FIXABLE[name], name).parent
    for command in WAYS[way]:
        assert main(shlex.split(command)) == 0, "".join(capsys.readouterr())
    status, printed = built(folder, tmp_path / "installed")
    assert status == 0, printed
    code = (
        "import demo; from demo.msg import Wind; from demo.srv import Ask; "
        "from demo.action import Go; import demo.talker; print(demo.__file__)"
    )
    path = run_with(
        sys.executable, "-c", code, cwd=tmp_path, PYTHONPATH=str(tmp_path / "installed")
    )
    assert str(tmp_path / "installed") in path
    share = tmp_path / "installed" / "share"
    assert (share / "demo/msg/Wind.msg").is_file()
    assert (share / "demo/action/Go.action").is_file()
    index = share / "ament_index/resource_index/rosidl_interfaces/demo"
    assert "msg/Wind.msg" in index.read_text()


HEAD = "from setuptools import setup\n"
#: What would never end, or grow without bounds, if each name were followed as often as it is used.
HOSTILE = {
    "circle": "a = a\nb = c\nc = b\nsetup(name=a, packages=b, data_files=c)\n",
    "doubled lists": "a0 = ['x']\n"
    + "".join(f"a{at + 1} = [*a{at}, *a{at}]\n" for at in range(99))
    + "setup(name='demo', packages=a99, data_files=a99)\n",
    "doubled texts": "a0 = 'xx'\n"
    + "".join(f"a{at + 1} = a{at} + a{at}\n" for at in range(99))
    + "setup(name=a99, packages=[a99])\n",
    "wide format": "setup(name='%999999999s' % 'a', packages=['{:>999999999}'.format('a')])\n",
    "deep sum": f"setup(name={' + '.join(['b'] * 500)}, packages=[])\n",
    "no arguments": "setup()\n",
}


@pytest.mark.parametrize("name", HOSTILE)
def test_what_names_stand_for_has_bounds(name, package, capsys):
    package(HEAD + HOSTILE[name])
    assert "Traceback" not in idlc(capsys, "check", "--fix")
    compile(Path("setup.py").read_text(), "setup.py", "exec")
