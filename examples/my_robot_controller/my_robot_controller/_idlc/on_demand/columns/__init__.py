"""Many serialized messages of one type as columns, without making messages.

`values.py` has what is given and returned. In between, `build.py` makes the plan of a type,
`scan.py` finds by it where everything is, and `table.py` makes columns of what was found;
`rows.py` and `arrow.py` bring them into the forms of numpy and Arrow.
"""

from .values import Batch, Columns, Ragged, Texts

__all__ = ["Batch", "Columns", "Ragged", "Texts"]
