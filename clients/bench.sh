#!/usr/bin/env bash
# Ticks decoded per second by the Python package, and nanoseconds per tick of the C header, double and float.
# PYTHON is an interpreter with the package (default: that of tests/python/run.sh).
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
python=${PYTHON:-${CARGO_TARGET_DIR:-target}/python-venv/bin/python}
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
"$python" -B clients/python/bench.py
"$python" -B clients/python/bench.py --frame > "$folder/frame"
for option in -UISOTHERM_FLOAT -DISOTHERM_FLOAT; do
    cc -std=c99 -O2 "$option" -o "$folder/bench" clients/c/bench.c
    "$folder/bench" < "$folder/frame"
done
