# Who may include whom (docs/adr/0001), and what clang-format says.
foreach(test layering formatting)
  add_test(NAME test_${test} COMMAND ${CMAKE_CURRENT_SOURCE_DIR}/${test}.sh)
  set_tests_properties(test_${test} PROPERTIES LABELS unit TIMEOUT 120 SKIP_RETURN_CODE 77)
endforeach()
