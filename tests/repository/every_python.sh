#!/bin/sh
# Run `make test` on each Python version named, where it is present: as pythonX.Y on PATH or
# among pyenv's. Says which ones were not found; fails if any run failed or none was found.
set -u
failed='' missing='' passed=''
for version in "$@"; do
    python=''
    for candidate in "python$version" "${PYENV_ROOT:-$HOME/.pyenv}/versions/$version".*/bin/python; do
        if "$candidate" -c '' 2>/dev/null; then python=$candidate && break; fi
    done
    if [ -z "$python" ]; then missing="$missing $version" && continue; fi
    echo "== Python $version ($python)"
    if make --no-print-directory test PYTHON="$python"; then
        passed="$passed $version"
    else
        failed="$failed $version"
    fi
done
echo "passed:${passed:- none}; failed:${failed:- none}; not found:${missing:- none}"
[ -z "$failed" ] && [ -n "$passed" ]
