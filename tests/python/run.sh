#!/usr/bin/env bash
# The Python subscriber against docs/wire-vectors.txt and against the Rust side; recordings, ROS 2 bags and Parquet files of
# `isotherm-replay convert` against what programs of others read in them.
#
# Makes a virtual environment under target/ for it. Skipped, in plain words, where Python or its venv module is missing.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."

if ! command -v python3 >/dev/null; then
    echo "skipped: python3 not found"
    exit 0
fi
if ! python3 -c 'import ensurepip, venv' 2>/dev/null; then
    echo "skipped: python3 has no venv module with pip"
    exit 0
fi
if ! python3 -c 'import sys; sys.exit(sys.version_info < (3, 9))'; then
    echo "skipped: python3 is older than 3.9"
    exit 0
fi

venv=${CARGO_TARGET_DIR:-target}/python-venv
case "$venv" in /*) ;; *) venv=$PWD/$venv ;; esac
[ -x "$venv/bin/pip" ] || python3 -m venv "$venv"
"$venv/bin/pip" install --quiet --disable-pip-version-check --requirement tests/python/requirements.txt

"$venv/bin/python" -B tests/python/subscriber.py --vectors docs/wire-vectors.txt
ISOTHERM_PYTHON=$venv/bin/python cargo test --release --locked --workspace --test system python_subscriber -- --nocapture

if ! "$venv/bin/python" -c 'import sys; sys.exit(sys.version_info < (3, 11))'; then
    echo "skipped: python3 is older than 3.11, which rosbags and duckdb need"
    exit 0
fi
ISOTHERM_PYTHON=$venv/bin/python cargo test --release --locked --workspace --test replay python_reads -- --nocapture
