#pragma once
/// \file What this machine can do at most, measured now: a benchmark without its ceiling says little.

#include <omp.h>

#include <algorithm>
#include <cstddef>
#include <vector>

#include "core/array.hpp"
#include "core/simd.hpp"

namespace hemowalk {

/// The middle one of \p v, which is not empty.
inline double middle_of(std::vector<double> v) {
  const auto middle = v.begin() + static_cast<std::ptrdiff_t>(v.size() / 2);
  std::nth_element(v.begin(), middle, v.end());
  return *middle;
}

/// Memory bandwidth, bytes/s: a[i] = s a[i] + t in place over 320 MB with all threads, counted as one read
/// and one write; median of \p repeats.
inline double memory_bandwidth(int repeats = 7) {
  Array<float> a(80'000'000);
  float* data = a.data();
  const auto n = static_cast<std::ptrdiff_t>(a.size());
  std::vector<double> times;
  for (int r = 0; r < repeats; ++r) {
    const double start = omp_get_wtime();
#pragma omp parallel for simd schedule(static)
    for (std::ptrdiff_t i = 0; i < n; ++i) data[i] = 0.999f * data[i] + 1.0f;
    times.push_back(omp_get_wtime() - start);
  }
  return 2.0 * sizeof(float) * static_cast<double>(n) / middle_of(times);
}

/// Rate of fused multiply-adds on full registers, flop/s (two per element), all threads; median of \p
/// repeats. Sixteen independent chains hide the latency.
template <class Real>
double fma_rate(int repeats = 5) {
  constexpr int W = static_cast<int>(64 / sizeof(Real)), chains = 16, rounds = 200'000;
  const int threads = omp_get_max_threads();
  std::vector<double> rates;
  for (int r = 0; r < repeats; ++r) {
    Real sum = 0;
    const double start = omp_get_wtime();
#pragma omp parallel reduction(+ : sum) num_threads(threads)
    {
      Pack<Real, W> x[chains];
      for (int c = 0; c < chains; ++c) x[c] = Real(c + 1);
      const Pack<Real, W> a(Real(0.999)), b(Real(0.001));
      for (int i = 0; i < rounds; ++i) {
#pragma GCC unroll 16
        for (int c = 0; c < chains; ++c) x[c] = a * x[c] + b;
      }
      for (int c = 0; c < chains; ++c) sum += x[c][0];
    }
    const double time = omp_get_wtime() - start;
    [[maybe_unused]] volatile Real kept = sum;  // so that the loop is not optimised away
    rates.push_back(2.0 * W * chains * rounds * threads / time);
  }
  return middle_of(rates);
}

}  // namespace hemowalk
