# common.sh: what the scripts share. Sourced, never run.
# shellcheck shell=bash

set -euo pipefail

# The checkout, wherever it lies; every script works from here.
ROOT="$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)"
cd "$ROOT"

# Nothing here may wait for an answer.
exec </dev/null

say() { printf '%s\n' "$*" >&2; }

fail() {
    say "$(basename "$0"): $*"
    exit 1
}

# quietly LOG COMMAND…: runs a command with its output in LOG; when it fails, shows the log's end.
quietly() {
    local log="$1"
    shift
    mkdir -p "$(dirname "$log")"
    if ! "$@" >"$log" 2>&1; then
        tail -n 40 "$log" >&2
        fail "this failed: $* (all of its output is in $log)"
    fi
}

# build_preset PRESET [CMAKE OPTION…]: configures and builds build/PRESET.
build_preset() {
    local preset="$1"
    shift
    quietly "build/$preset-configure.log" cmake --preset "$preset" "$@"
    quietly "build/$preset-build.log" cmake --build --preset "$preset"
}
