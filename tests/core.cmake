if(NOT TARGET hemowalk_data)
  return()
endif()

foreach(name statistics units yaml io trajectories transport_law)
  hemowalk_test(test_core_${name} SOURCES unit/test_core_${name}.cpp LINK hemowalk_data LABELS unit)
endforeach()

hemowalk_test(test_environment SOURCES unit/test_environment.cpp LINK hemowalk_core LABELS unit)

# The formats of campaigns and cases, without the programs behind them.
hemowalk_library(test_campaign_format
  SOURCES ${CMAKE_SOURCE_DIR}/coarse/case.cpp ${CMAKE_SOURCE_DIR}/workflow/campaign.cpp
          ${CMAKE_SOURCE_DIR}/workflow/campaign_format.cpp ${CMAKE_SOURCE_DIR}/workflow/reference.cpp
  LINK hemowalk_data)
target_compile_options(test_campaign_format PRIVATE -Wno-restrict)  # as in core/data.cmake
hemowalk_test(test_schema_scene SOURCES integration/test_schema_scene.cpp LINK hemowalk_data LABELS integration)
foreach(name campaign fuzz)
  hemowalk_test(test_schema_${name} SOURCES integration/test_schema_${name}.cpp LINK test_campaign_format LABELS integration)
endforeach()
