hemowalk_test(test_lbm_fluid SOURCES unit/test_lbm_fluid.cpp LINK hemowalk_lbm LABELS unit)
hemowalk_test(test_lbm_divided SOURCES unit/test_lbm_divided.cpp LINK hemowalk_lbm LABELS unit)
hemowalk_test(test_lbm_flows SOURCES verification/test_lbm_flows.cpp verification/test_lbm_energy.cpp LINK hemowalk_lbm LABELS verification)

find_package(benchmark QUIET)
if(benchmark_FOUND)
  add_executable(bench_lbm benchmarks/bench_lbm.cpp)
  target_link_libraries(bench_lbm PRIVATE hemowalk_lbm benchmark::benchmark)
  add_test(NAME bench_lbm COMMAND bench_lbm)
  set_tests_properties(bench_lbm PROPERTIES LABELS benchmark TIMEOUT 600)
endif()
# Run by hand: docs/evidence/gpu.md.
add_executable(bench_half_storage benchmarks/bench_half_storage.cpp)
target_link_libraries(bench_half_storage PRIVATE hemowalk_lbm)
