#!/usr/bin/env bash
# test_wasm.sh SCENES-PROGRAM RUNS-PROGRAM WORLDS-PROGRAM MODELS-PROGRAM FOLDER [--bench]: builds
# src/display, the run-length decoder and the drawing of models to WebAssembly and compares frames
# and pictures with the native ones, under node. Status 77 (skipped) where a tool is missing.
set -euo pipefail
root="$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)"
for tool in clang-14 wasm-ld-14 node; do
    if ! command -v "$tool" >/dev/null; then
        echo "skipped: $tool is missing; script/install-packages test installs it"
        exit 77
    fi
done
mkdir -p "$5"
"$root/script/build-wasm" "$5/veduta-display.wasm"
"$2" "$5/runs.bin"
node "$root/test/wasm/runs.mjs" "$5/veduta-display.wasm" "$5/runs.bin"
"$3" "$5/worlds.bin" 300
node "$root/test/wasm/scene.mjs" "$5/veduta-display.wasm" "$5/worlds.bin"
"$4" "$5/models.bin" 300
node "$root/test/wasm/models.mjs" "$5/veduta-display.wasm" "$5/models.bin"
"$1" "$5/scenes.bin" 300
node "$root/test/wasm/display.mjs" "$5/veduta-display.wasm" "$5/scenes.bin" "${@:6}"
