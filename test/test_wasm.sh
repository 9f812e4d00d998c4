#!/usr/bin/env bash
# test_wasm.sh SCENES-PROGRAM RUNS-PROGRAM FOLDER [--bench]: builds src/display and the run-length
# decoder to WebAssembly and compares frames and pictures with the native ones, under node. Status 77 (skipped) where a tool is missing.
set -euo pipefail
root="$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)"
for tool in clang-14 wasm-ld-14 node; do
    if ! command -v "$tool" >/dev/null; then
        echo "skipped: $tool is missing; script/install-packages test installs it"
        exit 77
    fi
done
mkdir -p "$3"
"$root/script/build-wasm" "$3/veduta-display.wasm"
"$2" "$3/runs.bin"
node "$root/test/wasm/runs.mjs" "$3/veduta-display.wasm" "$3/runs.bin"
"$1" "$3/scenes.bin" 300
node "$root/test/wasm/display.mjs" "$3/veduta-display.wasm" "$3/scenes.bin" "${@:4}"
