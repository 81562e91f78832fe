#pragma once
/// \file Where the time of a step goes.

#include <omp.h>

namespace hemowalk::resolved {

/// Adds the wall time of a scope to one part.
class Stopwatch {
 public:
  explicit Stopwatch(double& part) : part_(part), start_(omp_get_wtime()) {}
  ~Stopwatch() { part_ += omp_get_wtime() - start_; }

 private:
  double& part_;
  double start_;
};

}  // namespace hemowalk::resolved
