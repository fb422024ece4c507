"""The files of the playground: Pyodide and CodeMirror from npm, wheels, idlc, and the page."""

from __future__ import annotations

import hashlib
import json
import shutil
import subprocess
import sys
import tempfile
import zipfile
from collections.abc import Iterator
from pathlib import Path

HERE = Path(__file__).parent
ROOT = HERE.parents[1]
#: The wheels of wheels.txt, of this Python and platform: those of Pyodide.
_PLATFORM = """
    --only-binary :all: --no-deps --python-version 3.14 --implementation cp --abi cp314 --abi none
    --platform pyemscripten_2026_0_wasm32 --platform manylinux_2_17_x86_64
""".split()
PYODIDE = (
    "pyodide.mjs",
    "pyodide.asm.mjs",
    "pyodide.asm.wasm",
    "pyodide-lock.json",
    "python_stdlib.zip",
)
PAGE = ("index.html", "page.css", "worker.mjs")
_BESIDE_IDLC = (
    "editors/vscode/syntaxes/rosmsg.tmLanguage.json",
    "maintenance/__init__.py",
    "maintenance/playground/__init__.py",
    "maintenance/playground/session.py",
    "maintenance/website/__init__.py",
    "maintenance/website/colours.py",
)
#: The endings of what Python reads of a wheel.
_READ = (".py", ".lark", "emscripten.so")
#: Packages of idlc that the session does not import.
_UNUSED = ("cli", "build", "scaffold")


def build(out: Path) -> None:
    """Write the playground into `out`; needs npm, pip and their registries."""
    out.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory() as folder:
        work = Path(folder)
        for name in ("package.json", "package-lock.json", ".npmrc", "page.mjs", "compile.mjs"):
            shutil.copy(HERE / name, work)
        _run("npm", "ci", cwd=work)
        words = ["page.mjs", "--bundle", "--minify", "--format=esm", f"--outfile={out / 'page.js'}"]
        _run("node_modules/.bin/esbuild", *words, cwd=work)
        for name in PYODIDE:
            shutil.copy(work / "node_modules/pyodide" / name, out)
        for name in PAGE:
            shutil.copy(HERE / name, out)
        wheels = HERE / "wheels.txt"
        words = ["-m", "pip", "download", "--quiet", "--disable-pip-version-check"]
        words += ["--require-hashes", *_PLATFORM, "--dest", "wheels", "--requirement", str(wheels)]
        _run(sys.executable, *words, cwd=work)
        _archive(out / "packages.zip", work / "wheels")
        # the Python of the playground would take longer to compile modules than to import them
        _run("node", "compile.mjs", str(out / "packages.zip"), cwd=work)
    names = sorted(path.name for path in out.iterdir() if path.name != "sw.mjs")
    digest = hashlib.sha256()
    for name in names:
        digest.update((out / name).read_bytes())
    text = (HERE / "sw.mjs").read_text(encoding="utf-8")
    text = text.replace("%VERSION%", f"idlc-playground-{digest.hexdigest()[:16]}")
    listed = ", ".join(map(json.dumps, names))
    (out / "sw.mjs").write_text(text.replace("%FILES%", listed), encoding="utf-8")


def _run(*words: str, cwd: Path) -> None:
    done = subprocess.run(words, cwd=cwd, capture_output=True, text=True, check=False)
    if done.returncode:
        raise SystemExit(f"{done.stdout}{done.stderr}")


def _archive(path: Path, wheels: Path) -> None:
    """Write what Python imports as one archive, the same bytes for the same files."""
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, data in sorted([*_own_files(), *_wheel_files(wheels)]):
            archive.writestr(zipfile.ZipInfo(name), data, zipfile.ZIP_DEFLATED)


def _own_files() -> Iterator[tuple[str, bytes]]:
    for own in _BESIDE_IDLC:
        yield own, (ROOT / own).read_bytes()
    files = [*(ROOT / "idlc").rglob("*"), *(ROOT / "templates/message").iterdir()]
    for file in files:
        name = file.relative_to(ROOT)
        is_needed = file.is_file() and "__pycache__" not in name.parts
        if is_needed and name.parts[1] not in _UNUSED:
            yield name.as_posix(), file.read_bytes()


def _wheel_files(folder: Path) -> Iterator[tuple[str, bytes]]:
    for path in folder.glob("*.whl"):
        with zipfile.ZipFile(path) as wheel:
            for name in wheel.namelist():
                if "dist-info" not in name and name.endswith(
                    (".py", ".lark", "wasm32.so", "emscripten.so")
                ):
                    yield name, wheel.read(name)
