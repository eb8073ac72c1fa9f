#!/bin/sh
# A rest and twelve steps of a simulated rate table, one log each.
# usage: rates.sh [FOLDER]   writes logs, document and page into FOLDER (default: a new temporary one)
set -eu
cd "$(dirname "$0")/../.."
table=${1:-$(mktemp -d)}
mkdir -p "$table"
isotherm-replay simulate --print-preset mems-chamber --seed 7 > "$table/rest.toml"
isotherm-replay simulate "$table/rest.toml" --duration 20 --out "$table/rest.csv" >&2
{
    echo "log,axis,rate_deg_per_s,begin_s,end_s"
    echo "1,x,0,1,19"
} > "$table/steps.csv"
log=1
set -- "$table/rest.csv"
for axis in x,1.0,0.0,0.0 y,0.0,1.0,0.0 z,0.0,0.0,1.0; do
    for rate in 36.0 -36.0 108.0 -108.0; do
        log=$((log + 1))
        sed "s/^path = .*/path = { constant_rate = { axis = [${axis#?,}], rate_deg_per_s = $rate } }/" "$table/rest.toml" > "$table/step$log.toml"
        isotherm-replay simulate "$table/step$log.toml" --seed $log --duration 20 --out "$table/step$log.csv" >&2
        echo "$log,${axis%%,*},$rate,," >> "$table/steps.csv"
        set -- "$@" "$table/step$log.csv"
    done
done
isotherm-calibrate rates "$@" --mapping "$table/rest.mapping.toml" --unit MEMS-0001 --steps "$table/steps.csv" \
    --latitude 55.75 --heading 30 --pitch 0 --roll 0 --out "$table/MEMS-0001-rates.toml" --html "$table/rates.html"
echo "logs, document and page: $table" >&2
