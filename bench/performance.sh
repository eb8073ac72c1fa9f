#!/usr/bin/env bash
# Measures everything and writes docs/performance.md anew. About an hour; with QUICK=1 some minutes, for figures that say nothing
# but that all works: they go to a copy of the page under the target folder.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

target=${CARGO_TARGET_DIR:-target}
figures=$target/performance
quick=()
page=docs/performance.md
plots=docs/performance
mkdir -p "$figures"
if [ -n "${QUICK:-}" ]; then
    quick=(--quick)
    cp "$page" "$figures/performance.md"
    page=$figures/performance.md
    plots=$figures
fi

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
"$bench" report --from "$figures" --page "$page" --plots "$plots"
