# common.sh: what the scripts share. Sourced, never run.
# shellcheck shell=bash

set -euo pipefail

# The checkout, wherever it lies; every script works from here.
ROOT="$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)"
started="$(cd "$(dirname "$0")" && pwd)/$(basename "$0")"
cd "$ROOT"

# Nothing here may wait for an answer.
exec </dev/null

# ctest runs as many tests at once as there are processors, but those that are RUN_SERIAL.
export CTEST_PARALLEL_LEVEL="${CTEST_PARALLEL_LEVEL:-$(nproc)}"

say() { printf '%s\n' "$*" >&2; }

fail() {
    say "$(basename "$0"): $*"
    exit 1
}

# bad_use SENTENCE: fail for arguments that are not understood.
bad_use() {
    say "$(basename "$0"): $*; --help says more"
    exit 2
}

# --help prints the comment at the head of the script that was started.
for argument in "$@"; do
    case "$argument" in
    -h | --help)
        awk 'NR > 1 && !/^#/ { exit } NR > 1 { sub(/^# ?/, ""); print }' "$started"
        exit 0
        ;;
    esac
done

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

# sanitizer_runs SANITIZER [LAUNCHER…]: whether a program that does nothing runs under it here.
sanitizer_runs() {
    local program="build/probe-$1"
    mkdir -p build
    echo 'int main(void) { return 0; }' | cc -x c - -fsanitize="$1" -o "$program" &&
        "${@:2}" "$program"
} >/dev/null 2>&1

# prepare_sanitizers: sets what the sanitizers need on this machine: their options, and in `launcher`
# the command that programs under the thread sanitizer are started with.
prepare_sanitizers() {
    launcher=()
    # Looking for leaks needs ptrace, which some containers forbid.
    if ! sanitizer_runs address; then
        export ASAN_OPTIONS=detect_leaks=0
        say "leaks cannot be looked for here"
    fi
    # gcc 12's thread sanitizer cannot place its memory where addresses are spread over more than
    # 28 bits; setarch -R switches the spreading off.
    sanitizer_runs thread || launcher=(setarch "$(uname -m)" -R)
    # GDAL is not instrumented, so what it does with its own locks would be reported.
    export TSAN_OPTIONS=ignore_noninstrumented_modules=1
}
