#!/bin/sh
# Shows that check_layering.sh passes a good tree and fails on each kind of wrong include. Usage: test_layering.sh
set -eu
check=$(dirname "$0")/check_layering.sh
root=$(mktemp -d)
trap 'rm -rf "$root"' EXIT
failures=0

# expect good|bad FILE INCLUDE: a tree with this one include.
expect() {
  rm -rf "$root/tree"
  mkdir -p "$root/tree/$(dirname "$2")"
  printf '#pragma once\n#include %s\n' "$3" > "$root/tree/$2"
  if "$check" "$root/tree" > "$root/output" 2>&1; then found=good; else found=bad; fi
  if [ "$found" != "$1" ]; then
    echo "expected $1, found $found: $2 includes $3"
    failures=$((failures + 1))
  elif [ "$found" = bad ] && ! grep -q "^$2:2: includes" "$root/output"; then
    echo "the message does not name the place: $2 includes $3"; cat "$root/output"
    failures=$((failures + 1))
  fi
}

expect good core/units.cpp '"core/check.hpp"'
expect good core/data/scene.cpp '"core/yaml/schema.hpp"'
expect good core/hdf5.cpp '<hdf5.h>'
expect good resolved/simulation.cpp '"resolved/lbm/fluid.hpp"'
expect good resolved/npfem/batch.hpp '"resolved/mesh/mesh.hpp"'
expect good resolved/npfem/batch.hpp '<Eigen/Dense>'
expect good coarse/case.cpp '"core/data/formats.hpp"'
expect good workflow/pipeline.cpp '"calibration/calibration.hpp"'
expect good core/provenance.cpp '"hemowalk_commit.hpp"'

expect bad core/units.hpp '"coarse/case.hpp"'
expect bad core/units.hpp '"core/data/scene.hpp"'
expect bad core/array.hpp '"core/units.hpp"'
expect bad core/block.hpp '<mpi.h>'
expect bad core/yaml/schema.hpp '"core/data/scene.hpp"'
expect bad core/data/scene.hpp '"resolved/resolve.hpp"'
expect bad resolved/lbm/fluid.hpp '"resolved/npfem/batch.hpp"'
expect bad resolved/ibm/markers.hpp '"resolved/simulation.hpp"'
expect bad resolved/contact/law.hpp '"core/data/scene.hpp"'
expect bad resolved/npfem/batch.cpp '<hdf5.h>'
expect bad resolved/mesh/mesh.hpp '"resolved/lbm/fluid.hpp"'
expect bad resolved/simulation.cpp '"coarse/case.hpp"'
expect bad calibration/msd.cpp '"coarse/case.hpp"'
expect bad coarse/walk.hpp '"calibration/msd.hpp"'
expect bad coarse/walk.hpp '"workflow/campaign.hpp"'
expect bad coarse/case.cpp '<yaml-cpp/yaml.h>'
expect bad workflow/plan.cpp '"campaign.hpp"'

[ "$failures" -eq 0 ]
