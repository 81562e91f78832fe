hemowalk_test(test_coarse_random SOURCES unit/test_coarse_random.cpp LINK hemowalk_coarse LABELS unit)
hemowalk_test(test_coarse_law SOURCES unit/test_coarse_law.cpp LINK hemowalk_coarse LABELS unit)
hemowalk_test(test_coarse_walkers SOURCES unit/test_coarse_walkers.cpp LINK hemowalk_coarse LABELS unit)
# GCC 12 sees uninitialised operands in its own AVX-512 headers (GCC bug 105593).
target_compile_options(test_coarse_random PRIVATE -Wno-uninitialized -Wno-maybe-uninitialized)
hemowalk_test(test_coarse_simulation SOURCES unit/test_coarse_simulation.cpp LINK hemowalk_coarse LABELS unit)
hemowalk_test(test_coarse_fokker_planck SOURCES verification/test_coarse_fokker_planck.cpp LINK hemowalk_coarse
              LABELS verification)
hemowalk_test(test_coarse_slab SOURCES verification/test_coarse_slab.cpp LINK hemowalk_coarse LABELS verification)
hemowalk_test(test_coarse_impact_r SOURCES validation/test_coarse_impact_r.cpp LINK hemowalk_coarse LABELS validation)
add_executable(bench_coarse benchmarks/bench_coarse.cpp)
target_link_libraries(bench_coarse PRIVATE hemowalk_coarse)
target_include_directories(bench_coarse PRIVATE ${CMAKE_SOURCE_DIR}/tests)
