hemowalk_test(test_lbm_fluid SOURCES unit/test_lbm_fluid.cpp LINK hemowalk_lbm LABELS unit)
hemowalk_test(test_lbm_flows SOURCES verification/test_lbm_flows.cpp LINK hemowalk_lbm LABELS verification)
