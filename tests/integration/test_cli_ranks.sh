#!/usr/bin/env bash
# The resolved solver through mpirun: one record, one voice, right exit codes, stop and restart, and a
# campaign that starts its runs on two ranks.
# Usage: test_cli_ranks.sh PROGRAM MPIRUN
set -u
program=$1
mpirun=$2
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cd "$work" || exit 1
# A container's root on few cores: the test says so to Open MPI, the program never does.
export OMPI_ALLOW_RUN_AS_ROOT=1 OMPI_ALLOW_RUN_AS_ROOT_CONFIRM=1 OMPI_MCA_rmaps_base_oversubscribe=1 OMP_NUM_THREADS=1
failures=0
fail() { echo "FAIL $*"; failures=$((failures + 1)); }
ranks() { local n=$1; shift; "$mpirun" --quiet --bind-to none -n "$n" "$program" "$@"; }
# The same in the background, where $! is mpirun itself.
start_ranks() { local n=$1; shift; "$mpirun" --quiet --bind-to none -n "$n" "$program" "$@" & run=$!; }

cat >scene.yaml <<'YAML'
format: hemowalk.scene/1
acceleration: 50
domain: {size: [10 um, 12 um, 30 um]}
flow: {type: couette, shear_rate: 100 1/s, walls: both}
fluid: {precision: double}
cells: {hematocrit: 0.12, platelets_per_rbc: 1}
time: {end: 0.6 ms, sample: 0.1 ms, profile: 0.3 ms, surface: 0.3 ms}
YAML

"$program" resolve scene.yaml --out one --json >one.json 2>one.err || { fail "one rank: exit $?"; cat one.err; }
ranks 2 resolve scene.yaml --out two --json >two.json 2>two.err || { fail "two ranks: exit $?"; cat two.err; }
[ "$(grep -c '"format"' two.json)" = 1 ] || { fail "two ranks said more than one JSON object"; cat two.json; }
for key in steps rbc platelets hematocrit_true; do
  [ "$(grep "\"$key\"" one.json)" = "$(grep "\"$key\"" two.json)" ] || fail "$key differs between one and two ranks"
done
[ "$(ls one/surfaces)" = "$(ls two/surfaces)" ] || fail "other surfaces on two ranks"
[ -e two/checkpoint ] && fail "a finished run left its checkpoint"

# Too many ranks: refused, once, with what is possible.
ranks 4 resolve scene.yaml --out four >out.txt 2>&1
rc=$?
[ "$rc" = 2 ] || { fail "four ranks in a box for three: exit $rc"; cat out.txt; }
[ "$(grep -c 'use 3 or fewer ranks' out.txt)" = 1 ] || { fail "the refusal was not said once"; cat out.txt; }
grep -q '"exit_code": 2' four/status.json || { fail "status of the refused run"; cat four/status.json; }

# A cell blows up on one rank: all end, with the physics exit code and the cell's name, said once.
sed 's/^time:.*/time: {end: 6 ms, sample: 3 ms}/; s/acceleration: 50/acceleration: 60/' scene.yaml >blow.yaml
sed -i 's/cells: {.*/cells: {kinds: {rbc: {shape: rbc}}, explicit: [{kind: rbc, position: [5 um, 6 um, 22 um]}], loads: [{cell: 0, end: +z, fraction: 0.02, force: [0 pN, 0 pN, 1e9 pN]}]}/' blow.yaml
timeout 120 "$mpirun" --quiet --bind-to none -n 2 "$program" resolve blow.yaml --out blow >out.txt 2>&1
rc=$?
[ "$rc" = 3 ] || { fail "blow-up on one rank: exit $rc"; cat out.txt; }
[ "$(grep -cE 'blow-up|reach|lost' out.txt)" = 1 ] || { fail "the blow-up was not said once"; cat out.txt; }
grep -q '"exit_code": 3' blow/status.json || { fail "status after the blow-up"; cat blow/status.json; }

# Waits until the run in `stopped` was started for the $1-th time.
attempt() { for _ in $(seq 1200); do grep -q "\"attempt\": $1" stopped/status.json && return; sleep 0.05; done; fail "attempt $1 never began"; }

# Stopped through mpirun: a checkpoint and 75; goes on on the same ranks, and on one.
sed 's/end: 0.6 ms, sample: 0.1 ms/end: 12 ms, sample: 0.1 ms/' scene.yaml >long.yaml
start_ranks 2 resolve long.yaml --out stopped >out.txt 2>&1
for _ in $(seq 1200); do grep -q '"progress": 0.[0-9]*[1-9]' stopped/status.json 2>/dev/null && break; sleep 0.05; done
kill -USR1 $run
wait $run
rc=$?
[ "$rc" = 75 ] || { fail "stopped with $rc instead of 75"; cat out.txt; }
[ -s stopped/checkpoint/state.bin ] || fail "no checkpoint"
grep -q '"state": "interrupted"' stopped/status.json || { fail "not interrupted"; cat stopped/status.json; }
start_ranks 2 resolve long.yaml --out stopped --resume >out.txt 2>&1
attempt 2
kill -USR1 $run
wait $run
rc=$?
[ "$rc" = 75 ] || { fail "resumed and stopped again: $rc instead of 75"; cat out.txt; }
"$program" resolve long.yaml --out stopped --resume >out.txt 2>&1 &
run=$!
attempt 3
kill -TERM $run
wait $run
rc=$?
[ "$rc" = 75 ] || { fail "resumed on one rank: $rc instead of 75"; cat out.txt; }
grep -q 'made on 2 ranks: cut for 1' out.txt || { fail "the change of ranks was not said"; cat out.txt; }

# A campaign starts its runs on two ranks.
cat >campaign.yaml <<'YAML'
format: hemowalk.campaign/1
scene:
  acceleration: 50
  domain: {size: [10 um, 12 um, 20 um]}
  flow: {type: couette, shear_rate: 100 1/s, walls: both}
  cells: {hematocrit: 0.12, platelets_per_rbc: 5}
  time: {end: 1.3 ms, sample: 0.025 ms, profile: 0.5 ms}
calibrate: {t0: 0.2 ms, lag: 0.1 ms, bootstrap: 20}
launcher: {type: local, slots: 1, ranks: 2, threads: 1}
YAML
"$program" run campaign.yaml --out campaign >out.txt 2>&1 || { fail "campaign on two ranks: exit $?"; cat out.txt campaign/runs/*/log.txt; }
grep -q '"state": "done"' campaign/runs/*/status.json || fail "the campaign's run is not done"
PATH=/nowhere "$program" run campaign.yaml --out none >out.txt 2>&1
rc=$?
[ "$rc" = 2 ] && grep -q 'no mpirun' out.txt || { fail "without mpirun: exit $rc"; cat out.txt; }

[ "$failures" = 0 ] && echo "all as it should be"
exit "$failures"
