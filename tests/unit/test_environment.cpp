// What long tests read from the environment.
#include <gtest/gtest.h>

#include "support/environment.hpp"

namespace hemowalk::test {
namespace {

TEST(Environment, ListsHaveCommas) {
  EXPECT_EQ(numbers_of("16"), (std::vector<double>{16}));
  EXPECT_EQ(numbers_of("1,2.5,1e2"), (std::vector<double>{1, 2.5, 100}));
  EXPECT_EQ(numbers_of("16, 32 , 50"), (std::vector<double>{16, 32, 50}));
  for (const char* wrong : {"16 32", "16,,32", "fast", "16;32", "16 um"})
    EXPECT_THROW(numbers_of(wrong), std::invalid_argument) << wrong;
}

TEST(Environment, AccelerationsAreAskedForOrAsUsual) {
  ::unsetenv("HEMOWALK_ACCELERATIONS");
  EXPECT_EQ(accelerations("32,50"), (std::vector<double>{32, 50}));
  ::setenv("HEMOWALK_ACCELERATIONS", "4,8,16", 1);
  EXPECT_EQ(accelerations("32,50"), (std::vector<double>{4, 8, 16}));
  ::unsetenv("HEMOWALK_ACCELERATIONS");
}

}  // namespace
}  // namespace hemowalk::test
