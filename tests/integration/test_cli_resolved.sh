#!/usr/bin/env bash
# A campaign from a scene: its runs are child processes. Whatever is killed, the campaign goes on, and to the same bits.
# Usage: test_cli_resolved.sh PROGRAM
set -u
program=$1
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cd "$work" || exit 1
failures=0
fail() { echo "FAIL $*"; failures=$((failures + 1)); }
progress() { sed -n 's/.*"progress": \([0-9.]*\).*/\1/p' "$1"/runs/*/status.json 2>/dev/null | head -n 1; }
# Waits until the run of campaign folder $1 is under way, for as long as its driver lives: a busy machine is slow.
under_way() { while kill -0 "$driver" 2>/dev/null; do case "$(progress "$1")" in 0.[1-9]*) return 0 ;; esac; sleep 0.05; done; fail "$1 never got under way"; }
# The child of process $1 that runs the solver.
child_of() { cat "/proc/$1/task/$1/children" 2>/dev/null; }
# Everything calibrate sees in the only run of $1: equal text, equal trajectories to the bit.
seen() { "$program" calibrate "$1"/runs/* --t0 1ms --lag 1ms --bootstrap 20 --out "$1" --json 2>/dev/null | grep -vE 'wall_s|law_file'; }

cat >scene.yaml <<'YAML'
format: hemowalk.campaign/1
scene:
  acceleration: 50
  domain: {size: [12 um, 12 um, 12 um]}
  flow: {type: couette, shear_rate: 100 1/s, walls: both}
  cells: {hematocrit: 0.22, platelets_per_rbc: 1}
  time: {end: 24 ms, sample: 0.1 ms, profile: 2 ms}
calibrate: {t0: 1 ms, lag: 1 ms, bootstrap: 20}
on_failure: {action: retry, attempts: 2}
launcher: {threads: 1}  # beside other tests: threads that wait for one another must not wait for a core
YAML

"$program" run scene.yaml --out whole >out.txt 2>&1 || { fail "the whole campaign: exit $?"; cat out.txt; }
[ -s whole/report.html ] || fail "no report"
seen whole >whole.txt
grep -q D_m2_per_s whole.txt || fail "nothing to compare"

# The driver dies: its child writes a checkpoint; the next call goes on from there.
"$program" run scene.yaml --out driver >out.txt 2>&1 &
driver=$!
under_way driver
kill -9 $driver
wait $driver 2>/dev/null
"$program" resume scene.yaml --out driver >out.txt 2>&1 || { fail "resume after the driver was killed: exit $?"; cat out.txt; }
grep -q '"attempt": 2' driver/runs/*/status.json || { fail "no second attempt"; cat driver/runs/*/status.json; }
seen driver | cmp -s - whole.txt || fail "the resumed run differs from the whole one"

# A run dies: the campaign notices, says so and tries again.
"$program" run scene.yaml --out run >out.txt 2>&1 &
driver=$!
under_way run
# shellcheck disable=SC2046
kill -9 $(child_of $driver)
wait $driver || { fail "the campaign did not survive its run: exit $?"; cat out.txt; }
grep -q 'killed by signal 9' out.txt || { fail "the death of the run was not reported"; cat out.txt; }
seen run | cmp -s - whole.txt || fail "the repeated run differs from the whole one"

# Asked to stop: checkpoint, state interrupted, exit code 75.
"$program" run scene.yaml --out stopped >out.txt 2>&1 &
driver=$!
under_way stopped
kill -TERM $driver
wait $driver
rc=$?
[ "$rc" = 75 ] || { fail "stopped with $rc instead of 75"; cat out.txt; }
grep -q '"state": "interrupted"' stopped/runs/*/status.json || { fail "not interrupted"; cat stopped/runs/*/status.json; }
[ -e stopped/runs/*/checkpoint ] || fail "no checkpoint"

[ "$failures" = 0 ] && echo "all as it should be"
exit "$failures"
