#!/bin/sh
# Run `make test` on each Python version named, where it is present: as pythonX.Y on PATH or
# among pyenv's. Of 3.14/3.13, the first that is present counts. Says which ones were not found;
# fails if any run failed or none was found.
set -u
failed='' missing='' passed=''
for versions in "$@"; do
    python=''
    for version in $(echo "$versions" | tr / ' '); do
        for candidate in "python$version" "${PYENV_ROOT:-$HOME/.pyenv}/versions/$version".*/bin/python; do
            if "$candidate" -c '' 2>/dev/null; then python=$candidate && break 2; fi
        done
    done
    if [ -z "$python" ]; then missing="$missing $versions" && continue; fi
    echo "== Python $version ($python)"
    if make --no-print-directory test PYTHON="$python"; then
        passed="$passed $version"
    else
        failed="$failed $version"
    fi
done
echo "passed:${passed:- none}; failed:${failed:- none}; not found:${missing:- none}"
[ -z "$failed" ] && [ -n "$passed" ]
