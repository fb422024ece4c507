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

from maintenance.release.project import BESIDE, FailedError, Project, run

#: What setuptools adds to a source distribution.
ADDED = (
    "PKG-INFO",
    "setup.cfg",
    "idlc.egg-info/PKG-INFO",
    "idlc.egg-info/SOURCES.txt",
    "idlc.egg-info/dependency_links.txt",
    "idlc.egg-info/entry_points.txt",
    "idlc.egg-info/requires.txt",
    "idlc.egg-info/top_level.txt",
)
#: What is in a wheel about the package.
ABOUT = ("METADATA", "RECORD", "WHEEL", "entry_points.txt", "licenses/LICENSE", "top_level.txt")

TRY = """
import sys
from demo.msg import Drive
assert Drive.deserialize(Drive(speed=1.5).serialize()).speed == 1.5
assert 'idlc' not in sys.modules
"""


class Archives:
    """One source distribution and one wheel, as they are uploaded."""

    def __init__(self, project: Project, folder: Path) -> None:
        """Build both in a folder of their own."""
        self.project = project
        tree, out = folder / "tree", folder / "dist"
        project.copy(tree)
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
        sources = self.project.sources()
        about = {f"idlc-{self.project.version}.dist-info/{name}" for name in ABOUT}
        with zipfile.ZipFile(self.wheel) as wheel:
            _compare(self.wheel, set(wheel.namelist()), {*sources, *about})
        with tarfile.open(self.sdist) as sdist:
            inside = {one.name.partition("/")[2] for one in sdist if one.isfile()}
        _compare(self.sdist, inside, {*sources.values(), *BESIDE, *ADDED})

    def says_what_it_is(self) -> None:
        """The metadata are complete, and an index can show the README."""
        with zipfile.ZipFile(self.wheel) as wheel:
            (name,) = (one for one in wheel.namelist() if one.endswith("/METADATA"))
            told = HeaderParser().parsestr(wheel.read(name).decode("utf-8"))
        readme = self.wheel.parent / "README.md"
        readme.write_text(str(told.get_payload()), encoding="utf-8")
        shown = run(sys.executable, "-m", "readme_renderer", readme, cwd=readme.parent)
        readme.unlink()
        if "<table>" not in shown or "<h1" not in shown:
            raise FailedError("the README has no table or title where an index shows it")
        wanted = ["Summary", "Keywords", "Classifier", "License-Expression", "License-File"]
        wanted += ["Requires-Python", "Requires-Dist", "Provides-Extra", "Description-Content-Type"]
        wanted += ["Project-URL"] if self.project.repository else []
        if missing := [key for key in wanted if key not in told]:
            raise FailedError(f"the metadata lack {', '.join(missing)}")
        if told["Version"] != self.project.version:
            raise FailedError(f"the metadata say version {told['Version']}")

    def works(self) -> None:
        """Each installs without the other, and compiles an interface."""
        for archive in self.both:
            with tempfile.TemporaryDirectory() as folder:
                _install_and_use(archive, Path(folder), self.project.version)


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


def _install_and_use(archive: Path, folder: Path, version: str) -> None:
    """Install without the index: what idlc needs is what this Python has."""
    run(sys.executable, "-m", "venv", "--without-pip", folder / "env", cwd=folder)
    python = folder / "env" / "bin" / "python"
    site = sysconfig.get_path("purelib", vars={"base": str(folder / "env")})
    (Path(site) / "here.pth").write_text(sysconfig.get_path("purelib"), encoding="utf-8")
    options = ("--no-deps", "--no-build-isolation", "--no-index", "--ignore-installed")
    pip = ("-m", "pip", "--python", python, "install", "--quiet", *options)
    run(sys.executable, *pip, archive, cwd=folder)
    (folder / "demo" / "msg").mkdir(parents=True)
    (folder / "demo" / "msg" / "Drive.msg").write_text("float64 speed 0.5  # [m/s]\n")
    for name in ("idlc", "rosidlc"):
        said = run(python.parent / name, "--version", cwd=folder)
        if said != f"idlc {version}\n":
            raise FailedError(f"{archive.name} installs {said.strip()}")
    run(python.parent / "idlc", "gen", "demo", "-o", "out/demo", cwd=folder)
    run(python, "-I", "-c", f"import sys; sys.path.insert(0, 'out')\n{TRY}", cwd=folder)
