#!/usr/bin/env bash
# test_web.sh code|page|serve [PROGRAM]: builds the page and tests it. `code`: its modules under node.
# `page`: in Chromium, before a server that says what the test wants. `serve`: before PROGRAM's
# `veduta serve`. Status 77 (skipped) where a tool is missing.
set -euo pipefail
root="$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)"
skip() {
    echo "skipped: $*"
    exit 77
}
[ -z "${VEDUTA_TEST_REDUCED:-}" ] || skip "the page is the same in every build"
for tool in clang-14 wasm-ld-14 node npm; do
    command -v "$tool" >/dev/null ||
        skip "$tool is missing; script/install-packages test installs it"
done
least=18
if [ "$1" != code ]; then
    least=20
    [ -n "${CHROMIUM:-}" ] || command -v chromium >/dev/null ||
        skip "chromium is missing; script/install-packages test installs it"
fi
[ "$(node -p 'process.versions.node.split(".")[0]')" -ge $least ] ||
    skip "node is older than version $least"
if [ "$1" = serve ] && ! "$2" serve --help >/dev/null 2>&1; then
    skip "veduta was built without its server"
fi
[ -d "$root/web/node_modules" ] || timeout 60 npm view fzstd version >/dev/null 2>&1 ||
    skip "the npm registry cannot be reached, and web/node_modules is not there"
(
    flock 9 # tests run side by side
    "$root/script/build-web"
    cd "$root/web"
    node_modules/.bin/tsc -p tsconfig.json
) 9>"$root/build/web.lock"
cd "$root/web"
case "$1" in
code) exec node --test test/*.test.mjs ;;
page) exec node --test test/page.browser.mjs ;;
serve) VEDUTA="$2" exec node --test test/serve.browser.mjs ;;
*)
    echo "test_web.sh: there are code, page and serve"
    exit 2
    ;;
esac
