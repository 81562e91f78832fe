# Rules about the text of the program: who includes whom, and how it is formatted.
find_program(SH sh REQUIRED)
add_test(NAME layering COMMAND ${SH} ${CMAKE_SOURCE_DIR}/tests/support/check_layering.sh ${CMAKE_SOURCE_DIR})
add_test(NAME layering_rules COMMAND ${SH} ${CMAKE_SOURCE_DIR}/tests/support/test_layering.sh)
add_test(NAME format COMMAND ${SH} ${CMAKE_SOURCE_DIR}/tests/support/check_format.sh ${CMAKE_SOURCE_DIR})
set_tests_properties(layering layering_rules PROPERTIES LABELS unit TIMEOUT 60)
set_tests_properties(format PROPERTIES LABELS unit TIMEOUT 300 SKIP_RETURN_CODE 77)
