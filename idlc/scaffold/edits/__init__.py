"""Edits of files that the user owns: whole, or refused with what to add by hand."""
