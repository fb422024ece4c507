"""Generate rosidl's Python classes of a package of messages: rosidl_package.py FOLDER OUT.

FOLDER has msg/*.msg, OUT gets the package, named as OUT is. It cannot be sent: rosidl does that in
C, which is not compiled here.
"""

import json
import sys
import tempfile
from pathlib import Path

from rosidl_adapter import convert_to_idl
from rosidl_generator_py import generate_py

SHARE = Path(sys.prefix) / "share"


def main():
    folder, out = map(Path, sys.argv[1:])
    files = [path.relative_to(folder) for path in sorted(folder.glob("msg/*.msg"))]
    with tempfile.TemporaryDirectory() as place:
        for path in files:
            convert_to_idl(folder, out.name, path, Path(place))
        arguments = {
            "package_name": out.name,
            "output_dir": str(out),
            "idl_tuples": [f"{place}:{path.with_suffix('.idl')}" for path in files],
            "include_paths": [],
            "template_dir": str(SHARE / "rosidl_generator_py" / "resource"),
            "target_dependencies": [__file__],
        }
        record = Path(place, "arguments.json")
        record.write_text(json.dumps(arguments), encoding="utf-8")
        generate_py(str(record), [])
    (out / "__init__.py").touch()


if __name__ == "__main__":
    main()
