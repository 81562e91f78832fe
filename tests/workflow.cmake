# The program as a user meets it. Runs of the program get one thread: these tests are about behaviour, not speed.
if(TARGET hemowalk)
  hemowalk_test(test_holdout_walk SOURCES integration/test_holdout_walk.cpp LINK hemowalk_workflow LABELS integration)
  hemowalk_test(test_cli_json SOURCES integration/test_cli_json.cpp LINK hemowalk_workflow LABELS integration)
  hemowalk_test(test_local_launcher SOURCES integration/test_local_launcher.cpp LINK hemowalk_workflow LABELS integration)
  set_tests_properties(test_local_launcher PROPERTIES ENVIRONMENT
    "OMPI_ALLOW_RUN_AS_ROOT=1;OMPI_ALLOW_RUN_AS_ROOT_CONFIRM=1;OMPI_MCA_rmaps_base_oversubscribe=1")
  hemowalk_test(test_report SOURCES integration/test_report.cpp LINK hemowalk_workflow LABELS integration)
  hemowalk_test(test_cli_calibrate SOURCES integration/test_cli_calibrate.cpp LINK hemowalk_workflow LABELS integration)
  foreach(test test_cli_json test_cli_calibrate test_report)
    target_compile_definitions(${test} PRIVATE HEMOWALK_PROGRAM="$<TARGET_FILE:hemowalk>")
    add_dependencies(${test} hemowalk)
  endforeach()
  foreach(test test_cli_bad_input test_cli_campaign test_cli_launcher)
    add_test(NAME ${test} COMMAND ${CMAKE_CURRENT_SOURCE_DIR}/integration/${test}.sh $<TARGET_FILE:hemowalk>)
    set_tests_properties(${test} PROPERTIES LABELS integration TIMEOUT 600)
  endforeach()
  add_test(NAME test_cli_ranks COMMAND ${CMAKE_CURRENT_SOURCE_DIR}/integration/test_cli_ranks.sh $<TARGET_FILE:hemowalk>
    ${MPIEXEC_EXECUTABLE})
  set_tests_properties(test_cli_ranks PROPERTIES LABELS integration TIMEOUT 600)
  # Kills and resumes real runs: minutes on a busy machine.
  add_test(NAME test_cli_resolved COMMAND ${CMAKE_CURRENT_SOURCE_DIR}/integration/test_cli_resolved.sh $<TARGET_FILE:hemowalk>)
  set_tests_properties(test_cli_resolved PROPERTIES LABELS validation TIMEOUT 3600)
endif()
