# hemowalk_data: everything of core/ that needs a library: units, yaml, hdf5, provenance, log and the four nouns.
find_package(GSL REQUIRED)
set(MPI_CXX_SKIP_MPICXX ON)
find_package(MPI REQUIRED COMPONENTS CXX)
find_package(OpenSSL REQUIRED COMPONENTS Crypto)  # SHA-256; the HDF5 package brings it along
find_package(nlohmann_json REQUIRED)
find_package(spdlog REQUIRED)
find_package(fmt REQUIRED)
find_package(yaml-cpp REQUIRED)
find_package(PkgConfig REQUIRED)
pkg_check_modules(hemowalk_hdf5 REQUIRED IMPORTED_TARGET hdf5-openmpi)
find_path(UDUNITS2_INCLUDE udunits2.h REQUIRED)
find_library(UDUNITS2_LIBRARY udunits2 REQUIRED)

# The commit is asked at every build, but the header changes only with it.
set(commit_header ${CMAKE_CURRENT_BINARY_DIR}/generated/hemowalk_commit.hpp)
add_custom_target(hemowalk_commit
  COMMAND ${CMAKE_COMMAND} -D SOURCE=${CMAKE_SOURCE_DIR} -D HEADER=${commit_header}
          -P ${CMAKE_SOURCE_DIR}/core/commit.cmake
  BYPRODUCTS ${commit_header})

hemowalk_library(hemowalk_mpi SOURCES mpi.cpp LINK hemowalk_core MPI::MPI_CXX)
hemowalk_library(hemowalk_data
  SOURCES
    io.cpp log.cpp progress.cpp provenance.cpp statistics.cpp units.cpp
    data/scene.cpp data/scene_checks.cpp data/scene_format.cpp data/scene_write.cpp data/trajectories.cpp data/transport_law.cpp
    hdf5.cpp
    yaml/canonical.cpp yaml/describe.cpp yaml/document.cpp yaml/overrides.cpp yaml/scalars.cpp yaml/schema.cpp yaml/text.cpp
    yaml/validate.cpp
  LINK
    hemowalk_mpi GSL::gsl GSL::gslcblas yaml-cpp nlohmann_json::nlohmann_json spdlog::spdlog fmt::fmt
    PkgConfig::hemowalk_hdf5 OpenSSL::Crypto ${UDUNITS2_LIBRARY})
# GCC 12 sees an overlap in `"text" + std::string` that is not there (GCC bug 105651).
target_compile_options(hemowalk_data PRIVATE -Wno-restrict)
target_include_directories(hemowalk_data SYSTEM PUBLIC ${UDUNITS2_INCLUDE})
target_include_directories(hemowalk_data PRIVATE ${CMAKE_CURRENT_BINARY_DIR}/generated)
target_compile_definitions(hemowalk_data PRIVATE
  HEMOWALK_VERSION="${PROJECT_VERSION}" HEMOWALK_BUILD_TYPE="${CMAKE_BUILD_TYPE}"
  HEMOWALK_COMPILER="${CMAKE_CXX_COMPILER_ID} ${CMAKE_CXX_COMPILER_VERSION}")
add_dependencies(hemowalk_data hemowalk_commit)
