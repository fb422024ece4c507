"""Many serialized messages of one type as columns, without making messages.

`to_columns` and `to_arrow` of generated classes come here. `read.py` takes the messages, `plan.py`
makes the plan of a type, `scan.py` locates every field by it, `table.py` makes columns and
structured arrays of what is there (`source.py`), and `arrow.py` tables of Arrow. `elements.py`
takes elements of lists, and `values.py` has the types that are returned.
"""

from idlc.recordings.columns.arrow import to_arrow, to_rows
from idlc.recordings.columns.read import to_columns, unread_bytes

__all__ = ["to_arrow", "to_columns", "to_rows", "unread_bytes"]
