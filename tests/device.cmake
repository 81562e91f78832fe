# The device code, thread by thread on the host, and on a GPU where there is one (else those tests are skipped).
hemowalk_library(hemowalk_test_kernels KERNELS support/launch_kernels.cpp LINK hemowalk_core)
target_include_directories(hemowalk_test_kernels PRIVATE ${CMAKE_SOURCE_DIR}/tests)
hemowalk_test(test_device_launch SOURCES unit/test_device_launch.cpp LINK hemowalk_test_kernels LABELS unit)
hemowalk_test(test_device_fluid SOURCES unit/test_device_fluid.cpp LINK hemowalk_lbm LABELS unit)
hemowalk_test(test_device_markers SOURCES unit/test_device_markers.cpp LINK hemowalk_ibm LABELS unit)
hemowalk_test(test_device_membranes SOURCES unit/test_device_membranes.cpp LINK hemowalk_npfem LABELS unit)
hemowalk_test(test_device_bodies SOURCES unit/test_device_bodies.cpp LINK hemowalk_rigid LABELS unit)
hemowalk_test(test_device_contact SOURCES unit/test_device_contact.cpp LINK hemowalk_contact hemowalk_ibm hemowalk_mesh
              LABELS unit)
hemowalk_test(test_device_simulation SOURCES verification/test_device_simulation.cpp LINK hemowalk_step
              LABELS verification)
if(TARGET hemowalk_resolved)
  hemowalk_test(test_device_bench SOURCES verification/test_device_bench.cpp LINK hemowalk_resolved LABELS verification)
endif()
if(TARGET hemowalk_coarse)
  hemowalk_test(test_device_walkers SOURCES unit/test_device_walkers.cpp LINK hemowalk_coarse LABELS unit)
endif()
