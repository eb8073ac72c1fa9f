#!/usr/bin/env bash
# Measures everything: figures as JSON, all tables (performance.md) and plots in the target folder. About an hour; with QUICK=1
# some minutes, for figures that say nothing but that all works. docs/performance.md takes the figures it shows from there.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

target=${CARGO_TARGET_DIR:-target}
figures=$target/performance
quick=()
page=$figures/performance.md
mkdir -p "$figures"
if [ -n "${QUICK:-}" ]; then quick=(--quick); fi
for section in chain latency swaps throughput profiles scale units rated offline kernel; do
    printf '## %s\n\n<!-- figures: %s -->\n<!-- end -->\n\n' "$section" "$section"
done >"$page"

cargo build --release --locked --workspace --bins
bench=$target/release/isotherm-bench
step() {
    local name=$1
    shift
    echo "== $name: isotherm-bench $*"
    "$bench" "$@" --json >"$figures/$name.json.part"
    mv "$figures/$name.json.part" "$figures/$name.json"
}
if [ -n "${QUICK:-}" ]; then step kernel kernel --rounds 5; else step kernel kernel; fi
step chain chain --subject relay,keyed,service,python "${quick[@]}"
step profiles chain --measure latency --units 20 --rate 1000 --subject relay,service "${quick[@]}" \
    --profile default --profile pool-2 --profile rx-1 --profile batching-1ms
step scale scale "${quick[@]}"
"$bench" report --from "$figures" --page "$page" --plots "$figures"
