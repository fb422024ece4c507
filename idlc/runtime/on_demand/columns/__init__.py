"""Many serialized messages of one type as columns, without making messages.

`values.py` has the types that are passed in and returned. In between, `plan.py` makes the plan
of a type, `scan.py` locates every field by it, and `table.py` makes columns and structured
arrays; `read.py` and `arrow.py` are the entries, for numpy and for Arrow.
"""

from .values import Batch, Columns, Ragged, Texts

__all__ = ["Batch", "Columns", "Ragged", "Texts"]
