hemowalk_test(test_calibration_import SOURCES unit/test_calibration_import.cpp LINK hemowalk_calibration LABELS unit)
hemowalk_test(test_calibration_synthetic SOURCES unit/test_calibration_synthetic.cpp LINK hemowalk_calibration LABELS unit)
hemowalk_test(test_calibration_published SOURCES verification/test_calibration_published.cpp LINK hemowalk_calibration
              LABELS verification)
