"""The documentation site: docs/ and what idlc says of itself, as HTML that needs no other host.

`python -m maintenance.website OUT` writes it. Pages keep their form for the plain repository: only
links and places change on the way.
"""
