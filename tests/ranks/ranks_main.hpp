#pragma once
/// \file Tests that run as several MPI processes. Every rank runs all tests; a failure on any of them fails
/// the run.

#include <gtest/gtest.h>

#include "core/mpi.hpp"

namespace hemowalk::test {

/// All ranks of the test program.
const mpi::Ranks& world();

/// Waits for all ranks.
inline void barrier() {
  double nothing = 0;
  world().max({&nothing, 1});
}

}  // namespace hemowalk::test
