#!/usr/bin/env bash
# The launcher finds what is missing and installs exactly that; with nothing missing it installs nothing. The package
# tools and the build tools are stand-ins here that write down how they were called.
# Usage: test_cli_launcher.sh PROGRAM     (PROGRAM is only there for the common call)
set -u
source=$(cd "$(dirname "$0")/../.." && pwd)
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
failures=0
fail() { echo "FAIL $*"; failures=$((failures + 1)); }

mkdir -p "$work/tree" "$work/bin"
cp "$source/hemowalk" "$work/tree/"
stand_in() { printf '#!/bin/sh\necho "%s $*" >>"%s/calls"\n%s\n' "$1" "$work" "$2" >"$work/bin/$1"; chmod +x "$work/bin/$1"; }
# Knows every package but those in $work/absent.
stand_in dpkg-query "shift 2; for p in \"\$@\"; do grep -qx \"\$p\" '$work/absent' || echo \"installed \$p\"; done"
stand_in apt-get ":"
stand_in sudo 'exec "$@"'
stand_in cmake "mkdir -p '$work/tree/build/release/bin'; touch '$work/tree/build/release/build.ninja'"
stand_in ninja "printf '#!/bin/sh\necho program \"\$@\"\n' >'$work/tree/build/release/bin/hemowalk'; chmod +x '$work/tree/build/release/bin/hemowalk'"
call() { : >"$work/calls"; PATH=$work/bin:$PATH "$work/tree/hemowalk" "$@" >"$work/out" 2>"$work/err"; }

printf 'libgsl-dev\nlibcli11-dev\n' >"$work/absent"
call run x.yaml || fail "with packages missing: exit $?"
grep -q '^apt-get update' "$work/calls" || fail "the package lists were not brought up to date"
grep -q '^apt-get install .*libgsl-dev libcli11-dev *$' "$work/calls" || { fail "not exactly the missing packages were installed:"; cat "$work/calls"; }
grep -q '^cmake --preset release' "$work/calls" || fail "the first call did not configure"
[ "$(cat "$work/out")" = "program run x.yaml" ] || { fail "the program's output is not alone on stdout:"; cat "$work/out"; }

: >"$work/absent"
call --help || fail "second call: exit $?"
grep -q '^apt-get' "$work/calls" && fail "nothing was missing and still packages were installed"
grep -q '^cmake' "$work/calls" && fail "the second call configured again"
[ "$(cat "$work/out")" = "program --help" ] || fail "arguments did not arrive"

# A failing installation is said and nothing is run.
printf 'libgsl-dev\n' >"$work/absent"
stand_in apt-get 'exit 100'
call run x.yaml && fail "the installation failed and the launcher went on"
grep -q 'could not be installed' "$work/err" || fail "a failed installation was not explained"
[ -s "$work/out" ] && fail "the program ran without its packages"

[ "$failures" = 0 ] && echo "all as it should be"
exit "$failures"
