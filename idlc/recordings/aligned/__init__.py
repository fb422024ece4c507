"""Messages of several topics on one clock.

`clock.py` finds the message of each tick, `blend.py` computes values between two messages,
`describe.py` names units and enums, and `table.py` reads the messages and makes tables.
"""
