"""Messages of an earlier version of a type as messages of a later one."""
