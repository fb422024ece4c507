"""The source distribution and the wheel: made twice, compared, looked into and installed."""

from __future__ import annotations

import gzip
import io
import sys
import sysconfig
import tarfile
import tempfile
import zipfile
from email.parser import HeaderParser
from pathlib import Path
from typing import ClassVar

from maintenance.release.project import BESIDE, RUNTIME, FailedError, Project, run

#: What setuptools adds to a source distribution.
ADDED = ("PKG-INFO", "setup.cfg")
#: What it adds in a folder about the package.
LISTED = ("PKG-INFO", "SOURCES.txt", "dependency_links.txt", "top_level.txt")
#: What is in a wheel about the package.
ABOUT = ("METADATA", "RECORD", "WHEEL", "licenses/LICENSE", "top_level.txt")

TRY = """
import sys
from demo.msg import Drive
assert Drive.deserialize(Drive(speed=1.5).serialize()).speed == 1.5
assert 'idlc' not in sys.modules
"""


class Archives:
    """One source distribution and one wheel of idlc, as they are uploaded."""

    name = "idlc"
    #: The folder that describes it.
    home = "."
    #: Folders of the repository, and what they are called in the package.
    folders: ClassVar = {"idlc": "idlc", "templates": "idlc/templates"}
    #: The same in the source distribution.
    places: ClassVar = {"idlc": "idlc", "templates": "templates"}
    #: What there is only with commands and requirements, in a source distribution and a wheel.
    more: tuple[tuple[str, ...], tuple[str, ...]] = (
        ("entry_points.txt", "requires.txt"),
        ("entry_points.txt",),
    )
    said: tuple[str, ...] = ("Requires-Dist", "Provides-Extra")
    shown: tuple[str, ...] = ("<h1", "<table>")

    def __init__(self, project: Project, folder: Path) -> None:
        """Build both in a folder of their own."""
        self.project = project
        tree, out = folder / "tree", folder / "dist"
        described = {path: f"{self.home}/{path}" for path in BESIDE}
        project.copy({**described, **project.sources(self.places)}, tree)
        moment = project.moment()
        words = ("-m", "build", "--no-isolation", "--outdir", out, tree)
        run(sys.executable, *words, cwd=folder, SOURCE_DATE_EPOCH=str(moment))
        (self.sdist,) = out.glob("*.tar.gz")
        (self.wheel,) = out.glob("*.whl")
        _settle(self.sdist, moment)

    @property
    def both(self) -> tuple[Path, Path]:
        """The two files."""
        return self.sdist, self.wheel

    def is_complete(self) -> None:
        """No file is missing, and none is there that nobody needs."""
        with zipfile.ZipFile(self.wheel) as wheel:
            _compare(self.wheel, set(wheel.namelist()), self.in_wheel())
        with tarfile.open(self.sdist) as sdist:
            inside = {one.name.partition("/")[2] for one in sdist if one.isfile()}
        _compare(self.sdist, inside, self.in_sdist())

    def in_wheel(self) -> set[str]:
        """Return the files that the wheel has to have."""
        about = f"{self.name.replace('-', '_')}-{self.project.version}.dist-info"
        described = {f"{about}/{name}" for name in (*ABOUT, *self.more[1])}
        return {*self.project.sources(self.folders), *described}

    def in_sdist(self) -> set[str]:
        """Return the files that the source distribution has to have."""
        about = f"{self.name.replace('-', '_')}.egg-info"
        described = {f"{about}/{name}" for name in (*LISTED, *self.more[0])}
        return {*self.project.sources(self.places), *BESIDE, *ADDED, *described}

    def says_what_it_is(self) -> None:
        """The metadata are complete, and an index can show the README."""
        with zipfile.ZipFile(self.wheel) as wheel:
            (name,) = (one for one in wheel.namelist() if one.endswith("/METADATA"))
            told = HeaderParser().parsestr(wheel.read(name).decode("utf-8"))
        readme = self.wheel.parent / "README.md"
        readme.write_text(str(told.get_payload()), encoding="utf-8")
        shown = run(sys.executable, "-m", "readme_renderer", readme, cwd=readme.parent)
        readme.unlink()
        if not all(element in shown for element in self.shown):
            raise FailedError("the README has no table or title where an index shows it")
        wanted = ["Summary", "Keywords", "Classifier", "License-Expression", "License-File"]
        wanted += ["Requires-Python", "Description-Content-Type", *self.said]
        wanted += ["Project-URL"] if self.project.repository else []
        if missing := [key for key in wanted if key not in told]:
            raise FailedError(f"the metadata lack {', '.join(missing)}")
        if told["Version"] != self.project.version:
            raise FailedError(f"the metadata say version {told['Version']}")

    def works(self) -> None:
        """Each installs without the other, and an interface can be compiled and used."""
        for archive in self.both:
            with tempfile.TemporaryDirectory() as folder:
                self._install_and_use(archive, Path(folder))

    def _install_and_use(self, archive: Path, folder: Path) -> None:
        """Install without the index: what idlc needs is what this Python has."""
        python = _installed(archive, folder, alone=False)
        for name in ("idlc", "rosidlc"):
            said = run(python.parent / name, "--version", cwd=folder)
            if said != f"idlc {self.project.version}\n":
                raise FailedError(f"{archive.name} installs {said.strip()}")
        run(python.parent / "idlc", "gen", "demo", "-o", "out/demo", cwd=folder)
        _use(python, folder)


class RuntimeArchives(Archives):
    """The same of idlc-runtime, which needs nothing."""

    name = "idlc-runtime"
    home = RUNTIME
    folders: ClassVar = {"idlc/runtime": "idlc_runtime"}
    places = folders
    more = ((), ())
    said = ()
    shown = ("<h1",)

    def _install_and_use(self, archive: Path, folder: Path) -> None:
        """Use what this project's idlc compiles, in a Python without it."""
        python = _installed(archive, folder, alone=True)
        settings = '[tool.idlc]\nruntime = "installed"\n'
        (folder / "pyproject.toml").write_text(settings, encoding="utf-8")
        words = ("gen", "demo", "-o", "out/demo")
        root = str(self.project.root)
        run(sys.executable, "-m", "idlc", *words, cwd=folder, PYTHONPATH=root)
        _use(python, folder)


def are_equal(one: Archives, other: Archives) -> None:
    """Building again gives the same bytes."""
    for first, second in zip(one.both, other.both, strict=True):
        if first.name != second.name or first.read_bytes() != second.read_bytes():
            raise FailedError(f"{first.name} is not the same when it is built again")


def _compare(archive: Path, inside: set[str], wanted: set[str]) -> None:
    if missing := sorted(wanted - inside):
        raise FailedError(f"{archive.name} lacks {', '.join(missing)}")
    if more := sorted(inside - wanted):
        raise FailedError(f"{archive.name} has what nobody needs: {', '.join(more)}")


def _settle(sdist: Path, moment: int) -> None:
    """Write an archive again with nothing in it of when and by whom it was made."""
    made = io.BytesIO()
    with (
        tarfile.open(sdist) as old,
        gzip.GzipFile(filename="", fileobj=made, mode="wb", mtime=moment) as packed,
        tarfile.open(fileobj=packed, mode="w", format=tarfile.PAX_FORMAT) as new,
    ):
        for entry in sorted(old, key=lambda one: one.name):
            plain = tarfile.TarInfo(entry.name)
            plain.type, plain.size, plain.mtime = entry.type, entry.size, moment
            plain.mode = 0o755 if entry.isdir() else 0o644
            new.addfile(plain, old.extractfile(entry))
    sdist.write_bytes(made.getvalue())


def _installed(archive: Path, folder: Path, *, alone: bool) -> Path:
    """Return a new Python with what an archive installs: `alone`, or with what this one has.

    An interface to be compiled is in the folder `demo`.
    """
    run(sys.executable, "-m", "venv", "--without-pip", folder / "env", cwd=folder)
    python = folder / "env" / "bin" / "python"
    site = sysconfig.get_path("purelib", vars={"base": str(folder / "env")})
    link = Path(site) / "here.pth"
    link.write_text(sysconfig.get_path("purelib"), encoding="utf-8")  # pip builds with it
    options = ("--no-deps", "--no-build-isolation", "--no-index", "--ignore-installed")
    pip = ("-m", "pip", "--python", python, "install", "--quiet", *options)
    run(sys.executable, *pip, archive, cwd=folder)
    if alone:
        link.unlink()
    (folder / "demo" / "msg").mkdir(parents=True)
    (folder / "demo" / "msg" / "Drive.msg").write_text("float64 speed 0.5  # [m/s]\n")
    return python


def _use(python: Path, folder: Path) -> None:
    run(python, "-I", "-c", f"import sys; sys.path.insert(0, 'out')\n{TRY}", cwd=folder)
