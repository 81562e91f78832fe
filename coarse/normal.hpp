#pragma once
/// \file Elementary functions for all lanes: minimax polynomials in single precision (fitted for this project
/// by iteratively reweighted least squares), and the Box-Muller pair built from them. Largest relative errors
/// in float arithmetic, tested: log 2e-7, sine and cosine 2e-7 of the larger, exp 3e-7, erfcx 4e-7.

#include "coarse/philox.hpp"
#include "coarse/scalar_lanes.hpp"

namespace hemowalk::coarse {

/// sum c[k] x^k.
template <class Real, std::size_t N>
HEMO_HD HEMO_INLINE Real polynomial(const float (&c)[N], const Real& x) {
  Real sum = c[N - 1];
#pragma GCC unroll 16
  for (int k = static_cast<int>(N) - 2; k >= 0; --k) sum = sum * x + c[k];
  return sum;
}

/// -2 ln(x / 2^32) for 1 <= x <= 2^32: exact exponent, so small results keep their relative accuracy.
template <class L>
HEMO_HD HEMO_INLINE typename L::Real minus_two_log(const typename L::Real& x) {
  using Real = typename L::Real;
  using Int = typename L::Int;
  // mantissa in [sqrt(1/2), sqrt(2)), exponent to match
  const Int bits = same_bits<Int>(x), half_root = Int(0x3f3504f3);
  const Int exponent = (bits - half_root) >> 23;
  const Real m = same_bits<Real>(bits - (exponent << 23));
  const Real t = m - Real(1);
  static constexpr float c[] = {0.999999974f,  -0.49999988f, 0.333341856f,  -0.250020741f, 0.199568335f,
                                -0.165623931f, 0.149522668f, -0.143668428f, 0.0872235502f};
  const Real log_m = t * polynomial(c, t);
  return to_real(Int(32) - exponent) * Real(1.38629436112f) - Real(2) * log_m;
}

/// cos and sin of 2 pi w / 2^32.
template <class L>
HEMO_HD HEMO_INLINE void unit_circle(const typename L::Bits& w, typename L::Real& cosine,
                                     typename L::Real& sine) {
  using Real = typename L::Real;
  using Int = typename L::Int;
  using Bits = typename L::Bits;
  const Bits quadrant = (w + Bits(0x20000000u)) >> 30;
  const Int rest = as_signed(w - (quadrant << 30));  // [-2^29, 2^29): an eighth turn either way
  const Real a = to_real(rest) * Real(1.46291807926715968e-9f), a2 = a * a;
  static constexpr float cs[] = {0.999999997f, -0.166666502f, 0.00833201655f, -0.00019501831f};
  static constexpr float cc[] = {1.f, -0.499999996f, 0.0416666132f, -0.00138865293f, 2.43726865e-05f};
  const Real s = a * polynomial(cs, a2), c = polynomial(cc, a2);
  const auto odd = as_signed(quadrant << 31) < Int(0);
  const Bits sine_sign = (quadrant >> 1) << 31, cosine_sign = ((quadrant + Bits(1)) >> 1) << 31;
  cosine = same_bits<Real>(same_bits<Bits>(select(odd, s, c)) ^ cosine_sign);
  sine = same_bits<Real>(same_bits<Bits>(select(odd, c, s)) ^ sine_sign);
}

/// Two independent standard normal numbers sqrt(square) * cosine and sqrt(square) * sine (Box-Muller). They
/// are left factored because a step needs sqrt(variance * square): one square root for both. |z| < 6.7; the
/// smallest uniform is 2^-33.
template <class L>
struct NormalPair {
  typename L::Real square, cosine, sine;

  NormalPair() = default;
  HEMO_HD HEMO_INLINE NormalPair(const typename L::Bits& w0, const typename L::Bits& w1) {
    square = minus_two_log<L>(to_real(w0) + typename L::Real(0.5f));
    unit_circle<L>(w1, cosine, sine);
  }
};

/// Uniform in (0, 1] from 32 bits (rounded to single precision).
template <class L>
HEMO_HD HEMO_INLINE typename L::Real uniform(const typename L::Bits& w) {
  using Real = typename L::Real;
  return (to_real(w) + Real(0.5f)) * Real(2.3283064365386963e-10f);
}

/// e^x; x is clamped to [-87, 88].
template <class L>
HEMO_HD HEMO_INLINE typename L::Real exponential(const typename L::Real& x) {
  using std::max;
  using std::min;
  using Real = typename L::Real;
  using Int = typename L::Int;
  const Real y = min(max(x, Real(-87)), Real(88)) * Real(1.44269504089f);
  const Int n = to_int(y + select(y < Real(0), Real(-0.5f), Real(0.5f)));
  static constexpr float c[] = {
      1.f, 0.693147206f, 0.240226469f, 0.0555032878f, 0.00961848896f, 0.00133999312f, 0.000153458118f};
  return polynomial(c, y - to_real(n)) * same_bits<Real>((n + Int(127)) << 23);
}

/// e^(x^2) erfc(x), x >= 0.
template <class L>
HEMO_HD HEMO_INLINE typename L::Real erfcx(const typename L::Real& x) {
  using Real = typename L::Real;
  const Real t = Real(1) / (Real(1) + Real(0.4f) * x);
  static constexpr float c[] = {0.421612691f,  0.643722196f,  0.726271571f,  0.547961323f, 0.181186042f,
                                -0.106748835f, -0.119236139f, 0.0181464103f, 0.0502648736f};
  return t * polynomial(c, t - Real(0.5f));
}

}  // namespace hemowalk::coarse
