#!/usr/bin/env bash
# The Python package: its wheel is built, installed into a clean environment, and tested there against the frozen frames and the
# service. Recordings with their JSON, ROS 2 bags and Parquet files of `isotherm-replay convert` against what programs of others read in
# them. The bridge to ROS 2 against other implementations of its keys and messages.
#
# Makes a virtual environment under target/. ISOTHERM_BIN is the service's program (default: it is built here). Skipped, in plain words,
# where Python or its venv module is missing.
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
python3 -m venv --clear "$venv"
pip() { "$venv/bin/pip" --quiet --disable-pip-version-check "$@"; }
pip wheel --no-deps --wheel-dir "$venv/wheel" clients/python
wheel=$(echo "$venv"/wheel/isotherm-*.whl)
pip install "$wheel[recordings,parquet,plot]" --requirement tests/python/requirements.txt

if [ -z "${ISOTHERM_BIN:-}" ]; then
    cargo build --release --locked --bin isotherm --bin isotherm-replay --bin isotherm-ros
    ISOTHERM_BIN=${CARGO_TARGET_DIR:-$PWD/target}/release/isotherm
fi
export ISOTHERM_BIN
"$venv/bin/python" -B -m unittest discover --start-directory clients/python/tests
if [ -x "$venv/bin/mypy" ]; then
    (cd clients/python && "$venv/bin/mypy" --package isotherm --cache-dir "$venv/mypy")
fi
"$venv/bin/python" -B clients/python/bench.py 1
ISOTHERM_PYTHON=$venv/bin/python cargo test --release --locked --workspace --test system python_subscriber -- --nocapture

if ! "$venv/bin/python" -c 'import sys; sys.exit(sys.version_info < (3, 11))'; then
    echo "skipped: python3 is older than 3.11, which rosbags and duckdb need"
    exit 0
fi
ISOTHERM_PYTHON=$venv/bin/python cargo test --release --locked --workspace --test replay python_reads -- --nocapture
# zenoh-ros2-sdk without what it depends on: its modules of keys and attachments need nothing.
pip install --no-deps zenoh-ros2-sdk==0.1.8
"$venv/bin/python" -B tests/python/ros2.py ros2/vectors.json "$(dirname "$ISOTHERM_BIN")/isotherm-ros" \
    config/ros2.toml config/calibration
