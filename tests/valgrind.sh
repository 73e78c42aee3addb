#!/bin/sh
# Run calls that ask for memory out of bounds under valgrind: none may read or write there.
#
#     tests/valgrind.sh [number of calls of compiled functions]      300 by default
#
# hovi has to be installed in the environment of `python` (PYTHON=... for another one), or be on
# PYTHONPATH. Values that are not initialised are not looked for: Python and NumPy have many.
set -eu

here=$(cd "$(dirname "$0")" && pwd)
PYTHONMALLOC=malloc exec valgrind --quiet --error-exitcode=99 --undef-value-errors=no \
  --suppressions="$here/hard/loader.supp" \
  "${PYTHON:-python}" -W ignore "$here/hard/out_of_bounds.py" "${1:-300}"
