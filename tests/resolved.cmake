if(TARGET hemowalk_resolved)
  hemowalk_test(test_resolved
    SOURCES unit/test_resolved_units.cpp verification/test_resolved_simulation.cpp verification/test_resolved_friction.cpp
            verification/test_resolved_tube.cpp verification/test_resolved_recovery.cpp
            verification/test_resolved_platelet.cpp verification/test_resolved_wall_drag.cpp verification/test_resolved_energy.cpp verification/test_replaceable.cpp
            verification/test_resolved_orientation.cpp verification/test_scene_generality.cpp
    LINK hemowalk_resolved LABELS unit verification)
  hemowalk_test(test_couplings
    SOURCES unit/test_surface_traction.cpp verification/test_resolved_couplings.cpp LINK hemowalk_resolved LABELS unit verification)
  # Three processes, which cut groups of one and two from themselves; on any number of cores, as any user.
  function(hemowalk_ranks_test test count program)
    add_test(NAME ${test} COMMAND ${MPIEXEC_EXECUTABLE} -n ${count} --bind-to none $<TARGET_FILE:${program}> ${ARGN})
    set_tests_properties(${test} PROPERTIES LABELS verification TIMEOUT 600 ENVIRONMENT
      "OMPI_ALLOW_RUN_AS_ROOT=1;OMPI_ALLOW_RUN_AS_ROOT_CONFIRM=1;OMPI_MCA_rmaps_base_oversubscribe=1;OMPI_MCA_mpi_yield_when_idle=1;OMP_NUM_THREADS=1")
  endfunction()
  foreach(test test_resolved_ranks test_device_ranks)
    add_executable(${test} ranks/ranks_main.cpp ranks/${test}.cpp)
    target_link_libraries(${test} PRIVATE hemowalk_resolved GTest::gtest)
    target_include_directories(${test} PRIVATE ${CMAKE_SOURCE_DIR}/tests)
    hemowalk_ranks_test(${test} 3 ${test} "--gtest_filter=-*.FourAgreeWithOne")
  endforeach()
  hemowalk_ranks_test(test_four_ranks 4 test_resolved_ranks "--gtest_filter=Ranks.*:*.FourAgreeWithOne")
  target_sources(test_resolved_ranks PRIVATE ranks/test_ranks.cpp)
  # Run by hand, with mpirun: docs/evidence/scaling.md.
  add_executable(bench_ranks benchmarks/bench_ranks.cpp)
  target_link_libraries(bench_ranks PRIVATE hemowalk_resolved)
  target_include_directories(bench_ranks PRIVATE ${CMAKE_SOURCE_DIR}/tests)
  hemowalk_test(validate_resolved
    SOURCES validation/test_resolved_thickness.cpp validation/test_resolved_suspension.cpp
            validation/test_resolved_vessel.cpp validation/test_resolved_acceleration.cpp validation/test_default_coupling.cpp
    LINK hemowalk_resolved Eigen3::Eigen LABELS validation TIMEOUT 14400 EACH
    FIRST Vessel.PriesAt40um Vessel.PriesAt20umAnd15PerCent Vessel.PriesAt20umAnd30PerCent Suspension.TopAndBottomOverPackings)
  hemowalk_test(validate_rheology SOURCES validation/test_rheology.cpp LINK hemowalk_resolved LABELS validation TIMEOUT 14400 EACH)
  hemowalk_test(validate_energy SOURCES validation/test_energy.cpp validation/test_leakage.cpp LINK hemowalk_resolved LABELS validation TIMEOUT 14400 EACH)
  hemowalk_test(validate_capsule SOURCES validation/test_capsule.cpp validation/test_red_cells.cpp LINK hemowalk_resolved Eigen3::Eigen LABELS validation TIMEOUT 14400 EACH
    FIRST PairCollision.UnderTheThreeCouplings PairCollision.PushesCellsApartAtAnyAcceleration RedCell.TreadsAsTheBoundaryIntegral)
endif()
