#!/usr/bin/env bash
# Measures everything, as tables in target/performance. About an hour; with QUICK=1 some minutes, for figures that say nothing
# but that all works. docs/performance.md takes the figures it shows from there.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

target=${CARGO_TARGET_DIR:-target}
figures=$target/performance
quick=() rounds=()
mkdir -p "$figures"
if [ -n "${QUICK:-}" ]; then quick=(--quick) rounds=(--rounds 5); fi

cargo build --release --locked --workspace --bins
bench=$target/release/isotherm-bench
step() {
    local name=$1
    shift
    echo "== $name: isotherm-bench $*"
    "$bench" "$@" | tee "$figures/$name.txt"
}
step kernel kernel "${rounds[@]}"
step chain chain --subject relay,keyed,service,python "${quick[@]}"
step profiles chain --measure latency --units 20 --rate 1000 --subject relay,service "${quick[@]}" \
    --profile default --profile pool-2 --profile rx-1
step units chain --measure units --subject keyed,service --rounds 3 "${quick[@]}"
step offline offline "${quick[@]}"
