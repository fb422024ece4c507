"""Compare the hashes of installed message classes, computed from their fields, with ROS 2's.

Prints how many messages were looked at.
"""

import json
import sys
from importlib import import_module
from pathlib import Path

from lib.ros.vendor import type_hash

count = 0
for path in Path(sys.prefix, "share").glob("*/msg/*.json"):
    package = path.parts[-3]
    kind = getattr(import_module(f"{package}.msg"), path.stem)
    name = f"{package}/msg/{path.stem}"
    described = json.loads(path.read_text(encoding="utf-8"))["type_hashes"]
    assert {"type_name": name, "hash_string": type_hash(kind)} in described, name
    count += 1
print(count)
