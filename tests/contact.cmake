if(NOT TARGET hemowalk_contact OR NOT TARGET hemowalk_mesh)
  return()
endif()

hemowalk_test(test_contact
  SOURCES unit/test_contact_geometry.cpp unit/test_contact_forces.cpp unit/test_kernel_contact.cpp verification/test_contact_spheres.cpp
  LINK hemowalk_contact hemowalk_mesh LABELS unit verification)

find_package(benchmark QUIET)
if(benchmark_FOUND)
  add_executable(bench_contact benchmarks/bench_contact.cpp)
  target_link_libraries(bench_contact PRIVATE hemowalk_contact hemowalk_mesh benchmark::benchmark)
endif()

if(TARGET hemowalk_resolved)
  hemowalk_test(test_packing
    SOURCES unit/test_packing_census.cpp verification/test_packing_growth.cpp LINK hemowalk_resolved
    LABELS unit verification)
  hemowalk_test(test_surface_output SOURCES unit/test_surface_output.cpp LINK hemowalk_resolved LABELS unit)
endif()
