if(NOT TARGET hemowalk_npfem OR NOT TARGET hemowalk_rigid)
  return()
endif()

hemowalk_test(test_mesh
  SOURCES unit/test_mesh_shapes.cpp unit/test_mesh_file.cpp unit/test_mesh_observables.cpp
  LINK hemowalk_mesh LABELS unit)
hemowalk_test(test_npfem_terms SOURCES unit/test_npfem_terms.cpp LINK hemowalk_npfem LABELS unit)
hemowalk_test(test_npfem_batch SOURCES unit/test_npfem_batch.cpp LINK hemowalk_npfem LABELS unit)
hemowalk_test(test_rigid SOURCES unit/test_rigid_bodies.cpp LINK hemowalk_rigid LABELS unit)
hemowalk_test(test_npfem_dynamics SOURCES verification/test_npfem_dynamics.cpp LINK hemowalk_npfem LABELS verification)
hemowalk_test(test_boundary_integral
  SOURCES verification/test_boundary_integral.cpp
  LINK hemowalk_npfem Eigen3::Eigen LABELS verification)

find_package(benchmark QUIET)
if(benchmark_FOUND)
  add_executable(bench_npfem benchmarks/bench_npfem.cpp)
  target_link_libraries(bench_npfem PRIVATE hemowalk_npfem hemowalk_rigid benchmark::benchmark)
endif()

hemowalk_test(validate_solid SOURCES validation/test_solid_experiments.cpp LINK hemowalk_npfem LABELS validation TIMEOUT 1200 EACH)
