#pragma once
/// \file The only file that knows which compiler is at work. Everything else says HEMO_HD and is portable.

#if defined(__CUDACC__)
#define HEMO_HD __host__ __device__
#else
#define HEMO_HD
#endif

#if defined(__GNUC__) || defined(__CUDACC__)
#define HEMO_RESTRICT __restrict__
#define HEMO_INLINE inline __attribute__((always_inline))
#define HEMO_INLINE_LAMBDA __attribute__((always_inline))  // after a lambda's parameter list
#else
#define HEMO_RESTRICT
#define HEMO_INLINE inline
#define HEMO_INLINE_LAMBDA
#endif

namespace hemowalk {

/// Where memory lies and loops run.
enum class Place { host, device };

}  // namespace hemowalk
