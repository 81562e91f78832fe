#!/usr/bin/env bash
# compute-sanitizer on a machine with a GPU: memory, races in shared memory, uninitialised reads, barriers. Over the whole
# step and the hybrid (single precision, one rank), and over the device's half of every test that was built with CUDA (both
# precisions; groups of ranks under mpirun). Exit 1 on the first finding.
# Usage: tools/sanitize.sh [build folder, default build/cuda]
set -euo pipefail
cd "$(dirname "$0")/.."
build=${1:-build/cuda}
program=$build/tools/hemowalk_device
command -v compute-sanitizer >/dev/null || { echo "no compute-sanitizer on this machine (it comes with the CUDA toolkit)"; exit 77; }
cells=$(mktemp -u)
trap 'rm -f "$cells"' EXIT
small=(--box 15 --hematocrit 0.2 --acceleration 16 --bench 0 --cells "$cells")
for mode in "" --hybrid; do   # packs once, and must agree before anything else is looked at
  "$program" $mode "${small[@]}" --check 20
done
tests=$(find "$build/tests" -maxdepth 1 -type f -executable -name 'test_device_*' ! -name test_device_ranks 2>/dev/null | sort)
[ -n "$tests" ] || echo "no tests in $build: only the whole step and the hybrid are looked at (docs/evidence/gpu.md, section 2)"
for tool in memcheck racecheck initcheck synccheck; do
  watched=(compute-sanitizer --tool "$tool" --error-exitcode 1)
  for mode in "" --hybrid; do
    echo "== $tool: ${mode:-whole step}"
    "${watched[@]}" "$program" $mode "${small[@]}" --check 3
  done
  for test in $tests; do
    echo "== $tool: $(basename "$test")"
    "${watched[@]}" "$test" --gtest_filter='*/Device' --gtest_brief=1
  done
  if [ -x "$build/tests/test_device_ranks" ]; then
    echo "== $tool: test_device_ranks"
    mpirun -n 3 --oversubscribe --bind-to none "${watched[@]}" "$build/tests/test_device_ranks" --gtest_filter='*/Device'
  fi
done
