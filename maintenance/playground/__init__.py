"""The playground: idlc in a page, compiled to WebAssembly, as static files.

`python -m maintenance.playground OUT` writes it. Versions and hashes are pinned in
package-lock.json and wheels.txt.
"""
