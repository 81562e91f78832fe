#!/usr/bin/env bash
# Registers, stack frame and spills of every kernel, from ptxas, as a table. Needs nvcc, no GPU, no build.
# Usage: tools/kernel_report.sh [architecture ..., default 75 80 90]
set -euo pipefail
cd "$(dirname "$0")/.."
nvcc=$(command -v nvcc || echo /usr/local/cuda/bin/nvcc)
[ $# -gt 0 ] || set -- 75 80 90
log=$(mktemp)
trap 'rm -f "$log"' EXIT
# Every file listed under KERNELS.
files=$(find core resolved coarse tools -name CMakeLists.txt | sort | while read -r list; do
  grep -o 'KERNELS.*' "$list" | sed 's/LINK.*//; s/)//' | tr ' ' '\n' | grep '\.cpp$' | sed "s|^|$(dirname "$list")/|"
done)
for arch in "$@"; do
  for file in $files; do
    "$nvcc" -std=c++20 -O3 --expt-relaxed-constexpr -diag-suppress=554,1675 -Werror=cross-execution-space-call -DHEMOWALK_CUDA=1 -I. -Xcompiler=-fopenmp \
      -x cu -cubin -arch="sm_$arch" -Xptxas -v -o /dev/null "$file" >> "$log" 2>&1 || { tail -20 "$log"; exit 1; }
  done
done
[ -z "${KEEP_LOG:-}" ] || cp "$log" "$KEEP_LOG"
echo "architecture registers stack_bytes spill_store_bytes spill_load_bytes shared_bytes kernel"
awk '
  /Compiling entry function/ { split($0, q, "\x27"); name = q[2]; arch = q[4]; stack = stores = loads = 0 }
  /bytes stack frame/ { stack = $1; stores = $5; loads = $9 }
  /Used [0-9]+ registers/ && name {
    match($0, /Used [0-9]+/); used = substr($0, RSTART + 5, RLENGTH - 5)
    shared = match($0, /[0-9]+ bytes smem/) ? substr($0, RSTART, RLENGTH - 11) : 0
    print arch, used, stack, stores, loads, shared, name; name = ""
  }' "$log" | c++filt -p | sed 's/hemowalk:://g; s/void detail:://' | sort -u
