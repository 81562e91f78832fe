#!/usr/bin/env bash
# Every source file is as clang-format leaves it (.clang-format); 77 (skipped) without clang-format.
cd "$(dirname "$0")/.." || exit 1
command -v clang-format >/dev/null || { echo "no clang-format on this machine: not checked"; exit 77; }
files=$(find core resolved calibration coarse workflow tests -name '*.[hc]pp' -print0 | sort -z |
  xargs -0 -r clang-format --dry-run -Werror 2>&1 | sed -n 's/^\([^ :]*\):[0-9]*:[0-9]*: error:.*/\1/p' | sort -u)
[ -z "$files" ] && exit 0
echo "not formatted (clang-format -i would change them):"
echo "$files"
exit 1
