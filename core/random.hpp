#pragma once
/// \file Counter-based random numbers: Philox 4x32-10 (Salmon et al., SC 2011), bit for bit the
/// numbers of the Random123 library, on host and device.
///
/// A number is a pure function of (seed, stream, id, step): no state, no order, so results do not depend on
/// ranks, threads, save intervals or restarts. Use: `normal2(random_bits(seed, Stream::coarse_walk, walker,
/// step))`. One block of bits feeds 4 floats or 2 doubles; who needs more per (id, step) counts blocks in
/// `step`.

#include <cmath>
#include <cstddef>
#include <cstdint>

#include "core/portability.hpp"

namespace hemowalk {

/// Who draws. Two streams never share a number, whatever their ids and steps. The values are part of the
/// results: append, never renumber.
enum class Stream : std::uint32_t {
  packing = 1,      ///< initial positions and orientations; id = cell
  coarse_walk = 2,  ///< step laws; id = walker, step = time step
  coarse_wall = 3,  ///< reaction and trapping at walls; id = walker, step = time step
  bootstrap = 4,    ///< resampling in calibration; id = draw
  synthetic = 5,    ///< synthetic trajectories; id = platelet
  law_draw = 6,     ///< posterior draws of a transport law; id = draw
  initial = 7,      ///< initial positions of walkers; id = walker
  replica = 8,      ///< seeds of a campaign's replicas; id = replica
  test = 9,
};

/// 128 random bits.
struct RandomBits {
  std::uint32_t word[4];
};

/// Ten rounds of Philox 4x32 on \p counter, with the 64-bit key \p seed.
HEMO_HD inline RandomBits philox_bits(RandomBits counter, std::uint64_t seed) {
  auto k0 = static_cast<std::uint32_t>(seed), k1 = static_cast<std::uint32_t>(seed >> 32);
  std::uint32_t(&c)[4] = counter.word;
  for (int round = 0; round < 10; ++round) {
    const std::uint64_t p0 = std::uint64_t{0xD2511F53u} * c[0], p1 = std::uint64_t{0xCD9E8D57u} * c[2];
    c[0] = static_cast<std::uint32_t>(p1 >> 32) ^ c[1] ^ k0;
    c[2] = static_cast<std::uint32_t>(p0 >> 32) ^ c[3] ^ k1;
    c[1] = static_cast<std::uint32_t>(p1);
    c[3] = static_cast<std::uint32_t>(p0);
    k0 += 0x9E3779B9u;
    k1 += 0xBB67AE85u;
  }
  return counter;
}

/// The bits that belong to (seed, stream, id, step). id: 64 bits; step: 56 bits (higher bits are ignored).
HEMO_HD inline RandomBits random_bits(std::uint64_t seed, Stream stream, std::uint64_t id,
                                      std::uint64_t step) {
  return philox_bits(
      {{static_cast<std::uint32_t>(id), static_cast<std::uint32_t>(id >> 32),
        static_cast<std::uint32_t>(step),
        (static_cast<std::uint32_t>(step >> 32) & 0xffffffu) | (static_cast<std::uint32_t>(stream) << 24)}},
      seed);
}

/// Uniform in the open interval (0, 1) from 23 bits: both ends excluded, so log(u) and log(1 - u) are finite.
HEMO_HD inline float uniform_float(std::uint32_t bits) {
  return (static_cast<float>(bits >> 9) + 0.5f) * (1.0f / 8388608.0f);
}
/// Uniform in the open interval (0, 1) from 52 bits.
HEMO_HD inline double uniform_double(std::uint32_t high, std::uint32_t low) {
  const std::uint64_t k = (static_cast<std::uint64_t>(high) << 20) | (low >> 12);
  return (static_cast<double>(k) + 0.5) * (1.0 / 4503599627370496.0);
}

/// Two or four numbers drawn at once.
template <class T, int N>
struct Draws {
  T value[N];
  HEMO_HD constexpr const T& operator[](int i) const { return value[i]; }
};

HEMO_HD inline Draws<double, 2> uniform2(const RandomBits& b) {
  return {{uniform_double(b.word[0], b.word[1]), uniform_double(b.word[2], b.word[3])}};
}
HEMO_HD inline Draws<float, 4> uniform4(const RandomBits& b) {
  return {{uniform_float(b.word[0]), uniform_float(b.word[1]), uniform_float(b.word[2]),
           uniform_float(b.word[3])}};
}
/// Two independent standard normal numbers (Box-Muller), |z| < 8.6.
HEMO_HD inline Draws<double, 2> normal2(const RandomBits& b) {
  const Draws<double, 2> u = uniform2(b);
  const double radius = std::sqrt(-2 * std::log(u[0])), angle = 6.283185307179586477 * u[1];
  return {{radius * std::cos(angle), radius * std::sin(angle)}};
}
/// Four independent standard normal numbers in single precision (Box-Muller), |z| < 5.8.
HEMO_HD inline Draws<float, 4> normal4(const RandomBits& b) {
  const Draws<float, 4> u = uniform4(b);
  const float r0 = std::sqrt(-2 * std::log(u[0])), r1 = std::sqrt(-2 * std::log(u[2]));
  const float a0 = 6.2831853f * u[1], a1 = 6.2831853f * u[3];
  return {{r0 * std::cos(a0), r0 * std::sin(a0), r1 * std::cos(a1), r1 * std::sin(a1)}};
}

/// A sequence of numbers for one (seed, stream, id): for set-up work, where counting steps by hand is a
/// nuisance.
class RandomSequence {
 public:
  RandomSequence(std::uint64_t seed, Stream stream, std::uint64_t id = 0, std::uint64_t first_step = 0)
      : seed_(seed), stream_(stream), id_(id), step_(first_step) {}

  /// Uniform in (0, 1).
  double uniform() { return uniform2(next())[0]; }
  double uniform(double low, double high) { return low + (high - low) * uniform(); }
  double normal() {
    if (has_spare_) {
      has_spare_ = false;
      return spare_;
    }
    const Draws<double, 2> z = normal2(next());
    spare_ = z[1];
    has_spare_ = true;
    return z[0];
  }
  /// Uniform in 0 .. n-1; bias below n 2^-52.
  std::size_t below(std::size_t n) { return static_cast<std::size_t>(uniform() * static_cast<double>(n)); }
  /// 64 random bits.
  std::uint64_t bits() {
    const RandomBits b = next();
    return static_cast<std::uint64_t>(b.word[0]) << 32 | b.word[1];
  }

 private:
  RandomBits next() { return random_bits(seed_, stream_, id_, step_++); }

  std::uint64_t seed_;
  Stream stream_;
  std::uint64_t id_, step_;
  double spare_ = 0;
  bool has_spare_ = false;
};

}  // namespace hemowalk
