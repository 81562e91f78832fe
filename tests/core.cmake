if(NOT TARGET hemowalk_data)
  return()
endif()

hemowalk_test(test_core_statistics SOURCES unit/test_core_statistics.cpp LINK hemowalk_data LABELS unit)
