#!/usr/bin/env bash
# test_wasm.sh SCENES-PROGRAM RUNS-PROGRAM WORLDS-PROGRAM FOLDER [--bench]: builds src/display and the
# run-length decoder to WebAssembly and compares frames and pictures with the native ones, under
# node. Status 77 (skipped) where a tool is missing.
set -euo pipefail
root="$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)"
for tool in clang-14 wasm-ld-14 node; do
    if ! command -v "$tool" >/dev/null; then
        echo "skipped: $tool is missing; script/install-packages test installs it"
        exit 77
    fi
done
mkdir -p "$4"
"$root/script/build-wasm" "$4/veduta-display.wasm"
"$2" "$4/runs.bin"
node "$root/test/wasm/runs.mjs" "$4/veduta-display.wasm" "$4/runs.bin"
"$3" "$4/worlds.bin" 300
node "$root/test/wasm/scene.mjs" "$4/veduta-display.wasm" "$4/worlds.bin"
"$1" "$4/scenes.bin" 300
node "$root/test/wasm/display.mjs" "$4/veduta-display.wasm" "$4/scenes.bin" "${@:5}"
