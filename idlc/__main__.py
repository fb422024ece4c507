"""`python -m idlc`."""

import os
import sys

# `-m` puts the working folder first, where a repository of others may have a `json.py`: nothing
# else is imported before it is gone. If idlc itself comes from there, there is nothing to keep out.
try:
    HERE = os.getcwd()  # noqa: PTH109
except OSError:  # it was removed
    HERE = ""
if sys.path[0] == HERE and __file__ != os.path.join(HERE, "idlc", "__main__.py"):  # noqa: PTH118
    del sys.path[0]

from idlc.cli.main import main

sys.exit(main())
