#!/usr/bin/env bash
# compute-sanitizer over the whole step on a machine with a GPU: memory, races in shared memory, uninitialised reads,
# barriers. Usage: tools/sanitize.sh [build folder, default build/cuda]. Exit 1 on the first finding.
set -euo pipefail
cd "$(dirname "$0")/.."
program=${1:-build/cuda}/tools/hemowalk_device
command -v compute-sanitizer >/dev/null || { echo "no compute-sanitizer on this machine (it comes with the CUDA toolkit)"; exit 77; }
cells=$(mktemp -u)
trap 'rm -f "$cells"' EXIT
small=(--box 15 --hematocrit 0.2 --acceleration 16 --bench 0 --cells "$cells")
"$program" "${small[@]}" --check 20   # packs once, and must agree before anything else is looked at
for tool in memcheck racecheck initcheck synccheck; do
  echo "== $tool"
  compute-sanitizer --tool "$tool" --error-exitcode 1 "$program" "${small[@]}" --check 3
done
