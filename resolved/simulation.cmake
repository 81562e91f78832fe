find_package(PkgConfig REQUIRED)
pkg_check_modules(ZSTD REQUIRED IMPORTED_TARGET libzstd)
hemowalk_library(hemowalk_resolved
  SOURCES
    bench.cpp
    build.cpp
    checkpoint.cpp
    copies.cpp
    decomposition.cpp
    packing.cpp
    preflight.cpp
    recorder.cpp
    recovery.cpp
    region.cpp
    resolve.cpp
    simulation.cpp
    simulation_cells.cpp
    simulation_state.cpp
    surface_output.cpp
  LINK
    hemowalk_mesh hemowalk_lbm hemowalk_npfem hemowalk_rigid hemowalk_ibm hemowalk_contact hemowalk_data PkgConfig::ZSTD)
