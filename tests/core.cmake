if(NOT TARGET hemowalk_data)
  return()
endif()

foreach(name statistics units yaml io trajectories transport_law)
  hemowalk_test(test_core_${name} SOURCES unit/test_core_${name}.cpp LINK hemowalk_data LABELS unit)
endforeach()
