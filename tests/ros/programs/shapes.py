"""Print the shapes of messages as JSON: shapes.py NAME..."""

import json
import sys

from trees import class_of, shape_of

print(json.dumps({name: shape_of(class_of(*name.split("/"))) for name in sys.argv[1:]}))
