#!/usr/bin/env bash
# A campaign from trajectories: runs, is cached, survives kill -9 and continues, stops when asked.
# Usage: test_cli_campaign.sh PROGRAM
set -u
program=$1
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cd "$work" || exit 1
failures=0
fail() { echo "FAIL $*"; failures=$((failures + 1)); }
expect() { # CODE WHAT COMMAND..
  local code=$1 what=$2 rc
  shift 2
  "$@" >out.txt 2>err.txt
  rc=$?
  [ "$rc" = "$code" ] || { fail "$what: exit $rc instead of $code"; cat out.txt err.txt; }
}
said() { grep -qE "$1" out.txt err.txt || { fail "'$1' was not said in:"; cat out.txt err.txt; }; }

cat >small.yaml <<'YAML'
format: hemowalk.campaign/1
trajectories:
  - {name: first, synthetic: {platelets: 20, duration: 600 ms, seed: 3}}
  - {name: second, synthetic: {platelets: 20, duration: 600 ms, D: 60 um2/s, seed: 4}}
  - {name: absent, import: nowhere, optional: true}
calibrate: {t0: 100 ms, bootstrap: 50}
coarse: [{name: device, walkers: 2e4, dt: 1 s, end: 300 s, output: [60 s, 300 s]}]
out: results
YAML

expect 0 "plan" "$program" plan small.yaml
said 'new'
[ -e results ] && fail "plan wrote something"
expect 0 "first run" "$program" run small.yaml
said 'nowhere.*optional'
said '2 of 2 runs done \(0 cached\)'
for file in transport_law.yaml laws/second.yaml results.json report.html campaign.yaml coarse/device.h5 coarse/device-second.h5; do
  [ -s "results/$file" ] || fail "no results/$file"
done
[ "$(find results/runs -name trajectories.h5 | wc -l)" = 2 ] || fail "two runs should have trajectories"
grep -q '"state": "done"' results/runs/*/status.json || fail "no run says it is done"

before=$(find results/runs results/coarse results/laws -type f -printf '%p %T@\n' | sort)
expect 0 "second run" "$program" run small.yaml
said '2 cached'
[ "$before" = "$(find results/runs results/coarse results/laws -type f -printf '%p %T@\n' | sort)" ] || fail "the second run did something again"
expect 0 "plan of what is done" "$program" plan small.yaml
said 'cached'
expect 0 "status" "$program" status small.yaml
said 'done'

# One value changed: the trajectories stay, the law is made again.
expect 0 "another window" "$program" run small.yaml --set 'calibrate.t0=200 ms'
said '2 cached'
rm results/report.html
expect 0 "report" "$program" report results
[ -s results/report.html ] || fail "report did not make the page again"

# Killed in the middle of a walk: what was finished is kept, the next call does the rest.
sed -i 's/walkers: 2e4, dt: 1 s/walkers: 3e5, dt: 100 ms/; s/out: results/out: killed/' small.yaml
"$program" run small.yaml >out.txt 2>err.txt &
driver=$!
for _ in $(seq 600); do [ -e killed/results.json ] && break; sleep 0.05; done
kill -9 $driver
wait $driver 2>/dev/null
[ -e killed/results.json ] || fail "nothing was saved before the kill"
[ -e killed/report.html ] && fail "it was over before the kill: make the walk longer"
expect 0 "resume after kill -9" "$program" resume small.yaml
said '2 cached'
[ -s killed/report.html ] || fail "no report after resume"
find killed -name '*.tmp*' | grep -q . && fail "temporary files remain: $(find killed -name '*.tmp*')"

# Two at a time in one folder are refused; a stop signal ends the first with 75.
sed -i 's/out: killed/out: stopped/' small.yaml
"$program" run small.yaml >first.txt 2>&1 &
driver=$!
for _ in $(seq 600); do [ -e stopped/results.json ] && break; sleep 0.05; done
expect 2 "a second campaign in the same folder" "$program" run small.yaml
said 'in use'
kill -TERM $driver
wait $driver
rc=$?
[ "$rc" = 75 ] || { fail "stopped with $rc instead of 75"; cat first.txt; }

[ "$failures" = 0 ] && echo "all as it should be"
exit "$failures"
