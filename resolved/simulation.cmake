find_package(PkgConfig REQUIRED)
pkg_check_modules(ZSTD REQUIRED IMPORTED_TARGET libzstd)
hemowalk_library(hemowalk_resolved
  SOURCES
    bench.cpp
    checkpoint.cpp
    preflight.cpp
    recorder.cpp
    resolve.cpp
    surface_output.cpp
  LINK
    hemowalk_step hemowalk_data PkgConfig::ZSTD)
