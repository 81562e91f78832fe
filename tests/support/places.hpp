#pragma once
/// \file Tests of device code: run on the host always, on a GPU where there is one.

#include <gtest/gtest.h>

#include <string>

#include "core/device.hpp"

namespace hemowalk::test {

/// Fixture with a Place as parameter; the device's share of the tests is skipped where there is no device.
class OnPlace : public testing::TestWithParam<Place> {
 protected:
  void SetUp() override {
    if (GetParam() == Place::device && !device_present())
      GTEST_SKIP() << "no GPU is visible, or this binary was built without CUDA";
  }
};

inline std::string name_of(const testing::TestParamInfo<Place>& info) {
  return info.param == Place::host ? "Host" : "Device";
}

/// The order in which the host runs the threads of a block, for one scope.
struct ThreadOrder {
  explicit ThreadOrder(HostThreads order) : before(host_threads()) { host_threads() = order; }
  ~ThreadOrder() { host_threads() = before; }
  HostThreads before;
};

}  // namespace hemowalk::test

#define HEMOWALK_ON_BOTH_PLACES(Suite)                                                                     \
  INSTANTIATE_TEST_SUITE_P(Places, Suite, testing::Values(hemowalk::Place::host, hemowalk::Place::device), \
                           hemowalk::test::name_of)
