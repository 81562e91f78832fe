# hemowalk_data: everything of core/ that needs a library: units, yaml, hdf5, provenance, log and the four nouns.
find_package(GSL REQUIRED)

hemowalk_library(hemowalk_data
  SOURCES
    statistics.cpp
  LINK
    hemowalk_core GSL::gsl GSL::gslcblas)
