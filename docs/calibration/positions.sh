#!/bin/sh
# Twelve simulated positions of a stand; the third accelerometer's axis has turned by 60″ towards x since the shipped document.
# usage: positions.sh [FOLDER]   writes logs, document and page into FOLDER (default: a new temporary one)
set -eu
cd "$(dirname "$0")/../.."
stand=${1:-$(mktemp -d)}
mkdir -p "$stand"
isotherm-replay simulate --print-preset mems-chamber --seed 1 > "$stand/unit.toml"
echo start_s,end_s,position,log > "$stand/held.csv"
seed=100
while read -r heading pitch roll position; do
    seed=$((seed + 1))
    sed -e "s/^seed = .*/seed = $seed/" -e "s/^heading_deg = .*/heading_deg = $heading/" -e "s/^pitch_deg = .*/pitch_deg = $pitch/" \
        -e "s/^roll_deg = .*/roll_deg = $roll/" -e 's/0.0000349999998035625, .*/0.0003258883, -0.0001, 0.9999999419]]/' \
        "$stand/unit.toml" > "$stand/$seed.toml"
    isotherm-replay simulate "$stand/$seed.toml" --duration 40 --out "$stand/$seed.csv" >&2
    echo "2,39,$position,$seed.csv" >> "$stand/held.csv"
done <<'END'
  0.0   0.0 -90.0 Y up a
180.0   0.0 -90.0 Y up b
  0.0   0.0   0.0 Z down a
  0.0  90.0   0.0 X up a
  0.0   0.0 180.0 Z up a
  0.0 -90.0   0.0 X down a
  0.0   0.0  90.0 Y down a
180.0   0.0  90.0 Y down b
180.0   0.0 180.0 Z up b
180.0 -90.0   0.0 X down b
180.0   0.0   0.0 Z down b
180.0  90.0   0.0 X up b
END
isotherm-calibrate positions "$stand"/1*.csv --mapping "$stand/101.mapping.toml" --unit MEMS-0001 --times "$stand/held.csv" \
    --calibration config/calibration/MEMS-0001.toml --gravity 9.8157 --out "$stand/moved.toml" --html "$stand/positions.html"
isotherm-calibrate diff config/calibration/MEMS-0001.toml "$stand/moved.toml" --axis-sigma 3.3
echo "logs, document and page: $stand" >&2
