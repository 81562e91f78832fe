if(TARGET hemowalk_resolved)
  hemowalk_test(test_resolved
    SOURCES unit/test_resolved_units.cpp verification/test_resolved_simulation.cpp verification/test_resolved_friction.cpp
            verification/test_resolved_platelet.cpp verification/test_resolved_wall_drag.cpp
    LINK hemowalk_resolved LABELS unit verification)
  hemowalk_test(validate_resolved
    SOURCES validation/test_resolved_thickness.cpp validation/test_resolved_suspension.cpp
    LINK hemowalk_resolved LABELS validation TIMEOUT 3600)
  hemowalk_test(validate_capsule SOURCES validation/test_capsule.cpp validation/test_red_cells.cpp LINK hemowalk_resolved LABELS validation TIMEOUT 3600)
endif()
