#!/usr/bin/env bash
# test_wasm.sh SCENES-PROGRAM FOLDER [--bench]: builds src/display to WebAssembly and compares its frames
# with the native ones, under node. Status 77 (skipped) where a tool is missing.
set -euo pipefail
root="$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)"
for tool in clang-14 wasm-ld-14 node; do
    if ! command -v "$tool" >/dev/null; then
        echo "skipped: $tool is missing; script/install-packages test installs it"
        exit 77
    fi
done
mkdir -p "$2"
"$root/script/build-wasm" "$2/veduta-display.wasm"
"$1" "$2/scenes.bin" 300
node "$root/test/wasm/display.mjs" "$2/veduta-display.wasm" "$2/scenes.bin" "${@:3}"
