hemowalk_test(test_calibration_verdict SOURCES unit/test_calibration_verdict.cpp LINK hemowalk_calibration LABELS unit)
hemowalk_test(test_calibration_conditions SOURCES unit/test_calibration_conditions.cpp LINK hemowalk_calibration LABELS unit)
hemowalk_test(test_calibration_estimators SOURCES unit/test_calibration_estimators.cpp LINK hemowalk_calibration LABELS unit)
hemowalk_test(test_calibration_recovery SOURCES verification/test_calibration_recovery.cpp LINK hemowalk_calibration
              LABELS verification)
hemowalk_test(test_calibration_import SOURCES unit/test_calibration_import.cpp LINK hemowalk_calibration LABELS unit)
hemowalk_test(test_calibration_synthetic SOURCES unit/test_calibration_synthetic.cpp LINK hemowalk_calibration LABELS unit)
hemowalk_test(test_calibration_published SOURCES verification/test_calibration_published.cpp LINK hemowalk_calibration
              LABELS verification)
hemowalk_test(test_calibration_coverage SOURCES validation/test_calibration_coverage.cpp LINK hemowalk_calibration
              LABELS validation TIMEOUT 3600 EACH)
