#!/usr/bin/env bash
# Checks the generated types, and the scripts of the console in the browser against them. Skipped, in plain words, without npm.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
if ! command -v npm >/dev/null; then
    echo "skipped: npm not found (Debian: apt install npm)"
    exit 0
fi
tools=${CARGO_TARGET_DIR:-target}/typescript
mkdir -p "$tools"
[ -x "$tools/node_modules/.bin/tsc" ] || npm install --silent --no-audit --no-fund --prefix "$tools" typescript@5.9.3
"$tools/node_modules/.bin/tsc" --strict --noEmit --target es2023 clients/typescript/isotherm.ts
"$tools/node_modules/.bin/tsc" --project clients/typescript
