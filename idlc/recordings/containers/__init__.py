"""The files of recordings, read with the standard library until messages are asked for."""
