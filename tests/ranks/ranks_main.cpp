#include "ranks/ranks_main.hpp"

#include <memory>

namespace hemowalk::test {

namespace {
std::unique_ptr<mpi::Ranks> all;
}

const mpi::Ranks& world() { return *all; }

}  // namespace hemowalk::test

int main(int argc, char** argv) {
  using namespace hemowalk;
  testing::InitGoogleTest(&argc, argv);
  test::all = std::make_unique<mpi::Ranks>(mpi::Ranks::world());
  auto& listeners = testing::UnitTest::GetInstance()->listeners();
  if (!test::world().root()) delete listeners.Release(listeners.default_result_printer());
  int failed = RUN_ALL_TESTS();
  double any = failed;
  test::world().max({&any, 1});
  test::all.reset();
  mpi::finish();
  return any != 0;
}
