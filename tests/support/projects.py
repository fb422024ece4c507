"""Packages, libraries and workspaces as people write them, for the tests of `idlc init`."""

from typing import NamedTuple

MANIFEST = """\
<?xml version="1.0"?>
<?xml-model href="http://download.ros.org/schema/package_format3.xsd"?>
<package format="3">
  <name>{name}</name>
  <version>0.0.0</version>
  <description>TODO: Package description</description>
  <maintainer email="ada@example.com">ada</maintainer>
  <license>TODO: License declaration</license>

{depends}  <test_depend>python3-pytest</test_depend>

  <export>
    <build_type>{build_type}</build_type>
  </export>
</package>
"""
SETUP = """\
from setuptools import find_packages, setup

package_name = 'bot'

setup(
    name=package_name,
    version='0.0.0',
    packages=find_packages(exclude=['test']),
    data_files=[
        ('share/ament_index/resource_index/packages',
            ['resource/' + package_name]),
        ('share/' + package_name, ['package.xml']),
    ],
    install_requires=['setuptools'],
    zip_safe=True,
    maintainer='ada',
    maintainer_email='ada@example.com',
    description='TODO: Package description',
    license='TODO: License declaration',
    entry_points={
        'console_scripts': [
        ],
    },
)
"""
CFG = "[develop]\nscript_dir=$base/lib/bot\n[install]\ninstall_scripts=$base/lib/bot\n"
MESSAGE = {"msg/Level.msg": "float32 moisture  # [percent]\n"}
HEADER = {"interfaces/msg/Level.msg": "std_msgs/Header header\nfloat32 moisture  # [percent]\n"}
SERVICE = {"srv/Water.srv": "float32 amount  # [l]\n---\nbool done\n"}
LIBRARY = '[project]\nname = "track-kit"\nversion = "0.1.0"\nrequires-python = ">=3.10"\n\n'


class Sample(NamedTuple):
    """The files of a folder, its kind in words, and a class that it has after `idlc init`."""

    files: dict[str, str]
    words: str
    module: str
    name: str = "Example"


def ament(setup: str = SETUP, *, home: str = "bot", **files: str) -> dict[str, str]:
    """Return the files of an ament_python package."""
    return {
        "package.xml": MANIFEST.format(name="bot", build_type="ament_python", depends=""),
        "setup.py": setup,
        "setup.cfg": CFG,
        "resource/bot": "",
        f"{home}/__init__.py": "",
        f"{home}/talker.py": "def main():\n    print('hello')\n",
        "test/test_flake8.py": "def test_flake8():\n    pass\n",
        **files,
    }


def backend(requires: str, name: str) -> str:
    """Return the table of a build backend."""
    return f'[build-system]\nrequires = ["{requires}"]\nbuild-backend = "{name}"\n'


def library(text: str, home: str = "src/track_kit", **files: str) -> dict[str, str]:
    """Return the files of a library."""
    return {
        "pyproject.toml": text,
        "README.md": "# Track kit\n",
        f"{home}/__init__.py": '"""Tracks."""\n\n__version__ = "0.1.0"\n',
        f"{home}/py.typed": "",
        **files,
    }


PYTHON = "an ament_python package"
TUTORIAL = SETUP.replace("find_packages, ", "").replace(
    "find_packages(exclude=['test'])", "[package_name]"
)
BLACK = """\
import os
from glob import glob

from setuptools import setup

PACKAGE = "bot"

setup(
    name=PACKAGE,
    version="1.2.0",
    packages=[PACKAGE],
    data_files=[
        ("share/ament_index/resource_index/packages", ["resource/" + PACKAGE]),
        (os.path.join("share", PACKAGE), ["package.xml"]),
        (os.path.join("share", PACKAGE, "launch"), glob("launch/*.launch.py")),
    ],
    install_requires=["setuptools"],
    entry_points={"console_scripts": ["talker = bot.talker:main"]},
)
"""
GROWN = """\
from setuptools import setup

name = 'bot'
data_files = []
data_files.append(('share/ament_index/resource_index/packages', ['resource/' + name]))
data_files.append(('share/' + name, ['package.xml']))

setup(name=name, version='0.0.1', packages=[name], data_files=data_files)
"""
DECLARED = """\
[metadata]
name = bot
version = 0.0.1

[options]
packages = find:

[options.data_files]
share/ament_index/resource_index/packages = resource/bot
share/bot = package.xml

[develop]
script_dir = $base/lib/bot
[install]
install_scripts = $base/lib/bot
"""
SRC = SETUP.replace("find_packages(exclude=['test'])", "find_packages('src')").replace(
    "    data_files", "    package_dir={'': 'src'},\n    data_files"
)
MODERN = f"""\
{backend("setuptools>=61", "setuptools.build_meta")}
[project]
name = "bot"
version = "0.0.1"

[tool.setuptools]
packages.find = {{ include = ["bot*"] }}

[tool.setuptools.data-files]
"share/ament_index/resource_index/packages" = ["resource/bot"]
"share/bot" = ["package.xml"]
"""
CMAKE = """\
cmake_minimum_required(VERSION 3.8)
project(field_msgs)

find_package(ament_cmake REQUIRED)
find_package(rosidl_default_generators REQUIRED)

rosidl_generate_interfaces(${PROJECT_NAME}
  "msg/Field.msg"
)

ament_export_dependencies(rosidl_default_runtime)
ament_package()
"""
IN_GROUP = """\
  <buildtool_depend>ament_cmake</buildtool_depend>
  <buildtool_depend>rosidl_default_generators</buildtool_depend>
  <exec_depend>rosidl_default_runtime</exec_depend>
  <member_of_group>rosidl_interface_packages</member_of_group>
"""
INTERFACES = {
    "package.xml": MANIFEST.format(name="field_msgs", build_type="ament_cmake", depends=IN_GROUP),
    "CMakeLists.txt": CMAKE,
    "msg/Field.msg": "float64 size  # [m]\n",
}
#: Each as its documentation or its generator lays it out.
SAMPLES = {
    "ament: tutorial": Sample(ament(TUTORIAL), PYTHON, "bot.msg"),
    "ament: created": Sample(ament(), PYTHON, "bot.msg"),
    "ament: message": Sample(ament(TUTORIAL) | MESSAGE | SERVICE, PYTHON, "bot.msg", "Level"),
    "ament: service": Sample(ament() | SERVICE, PYTHON, "bot.srv", "Water"),
    "ament: black": Sample(ament(BLACK) | {"launch/a.launch.py": ""}, PYTHON, "bot.msg"),
    "ament: grown": Sample(ament(GROWN), PYTHON, "bot.msg"),
    "ament: declared": Sample(
        ament("from setuptools import setup\n\nsetup()\n") | {"setup.cfg": DECLARED},
        PYTHON,
        "bot.msg",
    ),
    "ament: src": Sample(ament(SRC, home="src/bot"), PYTHON, "bot.msg"),
    "ament: pyproject": Sample(
        ament("from setuptools import setup\n\nsetup()\n") | {"pyproject.toml": MODERN},
        PYTHON,
        "bot.msg",
    ),
    "uv": Sample(
        library(LIBRARY + backend("uv_build>=0.9,<2", "uv_build")),
        "a Python library in src/track_kit (built with uv)",
        "track_kit.ros.msg",
    ),
    "hatchling": Sample(
        library(LIBRARY + backend("hatchling", "hatchling.build"), "track_kit"),
        "a Python library in track_kit (built with hatchling)",
        "track_kit.ros.msg",
    ),
    "hatchling: message": Sample(
        library(LIBRARY + backend("hatchling", "hatchling.build")) | HEADER,
        "a Python library in src/track_kit (built with hatchling)",
        "track_kit.ros.msg",
        "Level",
    ),
    "setuptools": Sample(
        library(LIBRARY + backend("setuptools>=61", "setuptools.build_meta")),
        "a Python library in src/track_kit (built with setuptools)",
        "track_kit.ros.msg",
    ),
    "setuptools: flat": Sample(
        library(LIBRARY + backend("setuptools>=61", "setuptools.build_meta"), "track_kit"),
        "a Python library in track_kit (built with setuptools)",
        "track_kit.ros.msg",
    ),
    "setuptools: setup.py": Sample(
        {
            "setup.py": "from setuptools import setup\n\nsetup(\n    name='track_kit',\n"
            "    version='0.1.0',\n    packages=['track_kit'],\n)\n",
            "track_kit/__init__.py": "",
        },
        "a Python library in track_kit (built with setuptools)",
        "track_kit.ros.msg",
    ),
    "flit": Sample(
        library(LIBRARY.replace("-kit", "_kit") + 'description = "x"\n', "track_kit")
        | {
            "pyproject.toml": backend("flit_core>=3.4", "flit_core.buildapi")
            + LIBRARY.replace("-kit", "_kit").rstrip()
            + '\ndescription = "Tracks"\n'
        },
        "a Python library in track_kit (built with flit)",
        "track_kit.ros.msg",
    ),
    "poetry": Sample(
        library(
            '[tool.poetry]\nname = "track-kit"\nversion = "0.1.0"\ndescription = "Tracks"\n'
            'authors = ["Ada <ada@example.com>"]\n\n[tool.poetry.dependencies]\n'
            'python = "^3.10"\n\n' + backend("poetry-core", "poetry.core.masonry.api"),
            "track_kit",
        ),
        "a Python library in track_kit (built with poetry)",
        "track_kit.ros.msg",
    ),
    "pdm": Sample(
        library(LIBRARY + backend("pdm-backend", "pdm.backend")),
        "a Python library in src/track_kit (built with pdm)",
        "track_kit.ros.msg",
    ),
    "ament_cmake": Sample(
        INTERFACES,
        "a package for CMake with 1 interface",
        "field_msgs.msg",
        "Field",
    ),
    "empty": Sample({}, "this folder has no package yet", "project.msg"),
}
WORKSPACE = {
    "README.md": "",
    **{f"src/bot/{path}": text for path, text in (ament(TUTORIAL) | SERVICE).items()},
    **{f"src/field_msgs/{path}": text for path, text in INTERFACES.items()},
    **{
        f"src/tools/{path}": text.replace("bot", "tools")
        for path, text in ament(home="tools").items()
        if path != "resource/bot"
    },
    "src/tools/resource/tools": "",
}
