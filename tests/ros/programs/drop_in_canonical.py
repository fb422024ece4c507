"""Write the bytes of both sides anew as idlc writes what they say, and print all shapes.

drop_in_canonical.py OUTCOMES..., with idlc's classes. rmw_fastrtps leaves garbage in the padding
and after a message, so bytes can be compared only after they were read.
"""

import json
import sys
from pathlib import Path

from trees import class_of, shape_of


def message_of(key):
    return key.partition(" ")[0].partition("(")[0].partition(".")[0]


def canonical(key, data):
    try:
        return class_of(*message_of(key).split("/")).deserialize(data).serialize().hex()
    except ValueError:
        return f"no message: {data.hex()}"


def main():
    shapes = {}
    for path in map(Path, sys.argv[1:]):
        lines = []
        for line in path.read_text(encoding="utf-8").splitlines():
            key, outcome = json.loads(line)
            if "bytes" in outcome:
                outcome["bytes"] = canonical(key, bytes.fromhex(outcome["bytes"]))
            lines.append(json.dumps([key, outcome]))
            shapes.setdefault(message_of(key), None)
        path.write_text("\n".join(lines), encoding="utf-8")
    print(json.dumps({name: shape_of(class_of(*name.split("/"))) for name in shapes}))


if __name__ == "__main__":
    main()
