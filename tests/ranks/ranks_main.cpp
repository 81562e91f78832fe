#include "ranks/ranks_main.hpp"

#include <cstdio>
#include <memory>

namespace hemowalk::test {

namespace {
std::unique_ptr<mpi::Ranks> all;

/// What a rank that is not the root has to say: failures only.
class Failures : public testing::EmptyTestEventListener {
  void OnTestPartResult(const testing::TestPartResult& result) override {
    if (result.failed())
      std::fprintf(stderr, "rank %d: %s:%d: %s\n", world().rank(), result.file_name(), result.line_number(),
                   result.message());
  }
};
}  // namespace

const mpi::Ranks& world() { return *all; }

}  // namespace hemowalk::test

int main(int argc, char** argv) {
  using namespace hemowalk;
  testing::InitGoogleTest(&argc, argv);
  test::all = std::make_unique<mpi::Ranks>(mpi::Ranks::world());
  auto& listeners = testing::UnitTest::GetInstance()->listeners();
  if (!test::world().root()) {
    delete listeners.Release(listeners.default_result_printer());
    listeners.Append(new test::Failures);
  }
  int failed = RUN_ALL_TESTS();
  double any = failed;
  test::world().max({&any, 1});
  test::all.reset();
  mpi::finish();
  return any != 0;
}
