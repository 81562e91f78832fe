#!/bin/sh
# Who may include whom. Usage: check_layering.sh ROOT. Prints every include that breaks a rule; exit 1 if there is one.
set -eu
cd "$1"

find core resolved calibration coarse workflow -type f \( -name '*.hpp' -o -name '*.cpp' \) 2>/dev/null | LC_ALL=C sort |
  xargs grep -nE '^[[:space:]]*#[[:space:]]*include[[:space:]]*["<]' /dev/null |
  awk '
  function starts(text, prefix) { return substr(text, 1, length(prefix)) == prefix }
  function complain(why) { printf "%s:%s: includes %s (%s)\n", file, line, target, why; bad = 1 }

  # The folder a file belongs to, as the rules see it.
  function layer(path,   part, n) {
    n = split(path, part, "/")
    if (part[1] == "core") return n == 2 ? "core" : "core/" part[2]
    if (part[1] == "resolved") return n == 2 ? "resolved" : "resolved/" part[2]
    return part[1]
  }
  function is_solver(name) { return name ~ /^resolved\/(lbm|npfem|rigid|ibm|contact|mesh)$/ }
  # What a bare GPU machine has: a compiler and Eigen. These headers of core/ need nothing else.
  function is_bare(path) { return path ~ /^core\/(portability|check|view|array|parallel|simd|block|device|device_choice)\.hpp$/ }
  function needs_library(path) {
    return path ~ /^(hdf5|mpi|yaml-cpp|gsl|fmt|spdlog|nlohmann|CLI|udunits2|zstd|Random123|sqlite3|openssl)/
  }

  {
    file = $0; sub(/:.*/, "", file)
    line = $0; sub(/^[^:]*:/, "", line); sub(/:.*/, "", line)
    target = $0; sub(/^[^"<]*["<]/, "", target); sub(/[">].*/, "", target)
    quoted = $0 ~ /include[[:space:]]*"/
    from = layer(file); to = layer(target)

    if (!quoted) {
      if ((is_solver(from) || is_bare(file)) && needs_library(target)) complain("the solver core builds with a compiler and Eigen alone")
      # the literature table is part of the program, embedded at build time: no user writes it
      if (starts(target, "yaml-cpp") && from != "core/yaml" && file != "calibration/verdict.cpp") complain("YAML is read by the schema layer in core/yaml")
      if (starts(target, "hdf5") && file != "core/hdf5.cpp") complain("HDF5 is spoken by core/hdf5")
      next
    }
    if (target == "hemowalk_commit.hpp") next   # written by the build
    if (target !~ /\//) { complain("includes start at the root of the source tree"); next }

    if (is_bare(file) && !is_bare(target)) complain("the solver core headers include each other only")
    else if (from == "core" && to != "core" && !(file ~ /\.cpp$/ && starts(to, "core"))) complain("core includes nothing upward")
    else if (from == "core/yaml" && to != "core" && to != "core/yaml") complain("core includes nothing upward")
    else if (from == "core/data" && !starts(to, "core")) complain("core includes nothing upward")
    else if (is_solver(from) && to != from && to != "resolved/mesh" && !is_bare(target)) complain("lbm, npfem, rigid, ibm and contact know the mesh and the solver core, not each other")
    else if (from == "resolved" && !starts(to, "resolved") && !starts(to, "core")) complain("the verbs meet in core/data only")
    else if ((from == "calibration" || from == "coarse") && to != from && !starts(to, "core")) complain("the verbs meet in core/data only")
    else if (from ~ /^core|^resolved|^calibration|^coarse/ && to == "workflow") complain("nothing includes the workflow")
  }
  END { exit bad }'
