"""Where the classes are that `idlc.load` makes: this module is the package of what is in the cache.

So they have names by which any process can import them, which pickling needs.
"""

from idlc.recordings.load import folder

__path__ = [str(folder())]
