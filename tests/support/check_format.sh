#!/bin/sh
# All tracked sources are as .clang-format says. Usage: check_format.sh ROOT. Exit 77 (skipped) without clang-format or git.
set -eu
cd "$1"
command -v clang-format > /dev/null || { echo "skipped: clang-format is not installed"; exit 77; }
git rev-parse --is-inside-work-tree > /dev/null 2>&1 || { echo "skipped: not a git work tree"; exit 77; }
# Only files that are there: a file may be tracked and deleted at this moment.
git ls-files -z '*.hpp' '*.cpp' | xargs -0 -r ls -d 2> /dev/null |
  { bad=0; while read -r file; do
      clang-format --dry-run -Werror "$file" > /dev/null 2>&1 || { echo "$file: not formatted (.clang-format) run clang-format -i $file"; bad=1; }
    done; exit $bad; }
