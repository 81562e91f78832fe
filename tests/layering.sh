#!/usr/bin/env bash
# Who may include whom. Verbs meet in core/data only; the parts of the resolved solver meet in resolved/ only; compiler
# switches live in core/ only. Prints every offending line.
set -u
cd "$(dirname "$0")/.." || exit 1
failures=0

# may FOLDER PATTERN: files directly or deeper in FOLDER include project headers that match PATTERN, nothing else.
may() {
  local lines
  lines=$(grep -rnE '^ *#include "' "$1" --include='*.hpp' --include='*.cpp' | grep -vE "#include \"($2)")
  [ -z "$lines" ] || { echo "$1/ may include $2 only:"; echo "$lines"; failures=$((failures + 1)); }
}
# solver_core FILE..: what a bare GPU machine builds: no data, no yaml, no HDF5.
solver_core() {
  local lines
  lines=$(grep -nE '#include ("core/(data|yaml|hdf5|io|log|progress|provenance|units)|<(yaml-cpp|hdf5|mpi|spdlog|fmt|nlohmann))' "$@" /dev/null)
  [ -z "$lines" ] || { echo "the solver core builds with a compiler and Eigen alone:"; echo "$lines"; failures=$((failures + 1)); }
}

may core 'core/|hemowalk_commit.hpp'
may calibration 'core/|calibration/'
may coarse 'core/|coarse/'
may resolved 'core/|resolved/'
for part in mesh lbm ibm contact; do may resolved/$part "core/|resolved/$part/"; done
for part in npfem rigid; do may resolved/$part "core/|resolved/mesh/|resolved/$part/"; done
# shellcheck disable=SC2046
solver_core $(find resolved/mesh resolved/lbm resolved/npfem resolved/rigid resolved/ibm resolved/contact -name '*.[hc]pp')

lines=$(grep -rnE '^ *# *(if|ifdef|elif).*(CUDA|__GNUC__|_OPENMP)' resolved calibration coarse workflow --include='*.hpp' --include='*.cpp')
[ -z "$lines" ] || { echo "compiler switches belong to core/:"; echo "$lines"; failures=$((failures + 1)); }

exit "$failures"
