"""The extension of VS Code, as `make vscode` packs it and marketplaces show it."""

from __future__ import annotations

import json
import zipfile
from pathlib import Path

from maintenance.release.project import EXTENSION, FailedError, Project

#: Files that vsce renames or writes itself.
_RENAMED = {"LICENSE": "LICENSE.txt", "README.md": "readme.md"}
_OF_VSCE = ("[Content_Types].xml", "extension.vsixmanifest")
#: What the build makes, with the licences of the packages in it.
_BUILT = ("dist/extension.js", "dist/licenses.txt")
#: The size that the VS Code marketplace asks for, in a PNG's header.
_ICON = b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR" + (128).to_bytes(4, "big") * 2


def is_complete(project: Project, vsix: Path) -> None:
    """The extension's archive has its manifest, icon, licences, and no other files."""
    manifest = json.loads(project.text(f"{EXTENSION}/package.json"))
    contributed = manifest["contributes"]
    named = (
        "package.json",
        manifest["icon"],
        *(language["configuration"] for language in contributed["languages"]),
        *(grammar["path"] for grammar in contributed["grammars"]),
        *_RENAMED.values(),
        *_BUILT,
    )
    expected = {*_OF_VSCE, *(f"extension/{path.removeprefix('./')}" for path in named)}
    with zipfile.ZipFile(vsix) as archive:
        files = set(archive.namelist())
        if files != expected:
            differing = ", ".join(sorted(files ^ expected))
            raise FailedError(f"{vsix.name} has too few or too many files: {differing}")
        if json.loads(archive.read("extension/package.json")) != manifest:
            raise FailedError(f"{vsix.name} was built from another package.json")
        if not archive.read(f"extension/{manifest['icon']}").startswith(_ICON):
            raise FailedError(f"{manifest['icon']} is not a PNG of 128 by 128 pixels")
        licence = archive.read("extension/LICENSE.txt").decode()
        if licence.split() != project.text("LICENSE").split():
            raise FailedError(f"{vsix.name} has another LICENSE")
        if b"vscode-languageclient" not in archive.read("extension/dist/licenses.txt"):
            raise FailedError(f"{vsix.name} lacks the licences of the packages in it")
