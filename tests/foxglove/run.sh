#!/usr/bin/env bash
# Recordings as Foxglove reads them. ISOTHERM_REPLAY is the program (default: it is built here). Skipped, in plain words, without npm.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
if ! command -v npm >/dev/null; then
    echo "skipped: npm not found (Debian: apt install npm)"
    exit 0
fi
target=${CARGO_TARGET_DIR:-target}
tools=$target/foxglove
mkdir -p "$tools"
[ -d "$tools/node_modules/ajv" ] ||
    npm install --silent --no-audit --no-fund --prefix "$tools" @foxglove/schemas@2.1.0 @mcap/core@2.2.2 @mcap/support@1.1.0 ajv@8.17.1
if [ -z "${ISOTHERM_REPLAY:-}" ]; then
    cargo build --release --workspace --locked --bins
    ISOTHERM_REPLAY=$target/release/isotherm-replay
fi
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
"$ISOTHERM_REPLAY" simulate --preset zeeman-sine --duration 10 --out "$work/laser.csv"
"$ISOTHERM_REPLAY" convert "$work/laser.csv" --unit ZLG-0001 --out "$work/raw.mcap"
"$ISOTHERM_REPLAY" correct "$work/laser.csv" --calibration config/calibration/ZLG-0001.toml --out "$work/corrected.mcap"
said=$(node tests/foxglove/check.mjs "$tools" "$work/raw.mcap" "$work/corrected.mcap")
echo "$said"
for name in CorrectedTick RawGyroTick RawAccelerometerTick RawTemperature; do
    grep -q "\"isotherm.$name\":[1-9]" <<<"$said" || { echo "no message of isotherm.$name" >&2; exit 1; }
done
