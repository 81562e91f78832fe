if(TARGET hemowalk_resolved)
  hemowalk_test(test_resolved
    SOURCES unit/test_resolved_units.cpp verification/test_resolved_simulation.cpp verification/test_resolved_friction.cpp
    LINK hemowalk_resolved LABELS unit verification)
endif()
