// What ranks say to each other: sums, parts, flags, and above all errors.

#include <numeric>
#include <string>

#include "ranks/ranks_main.hpp"

namespace hemowalk::mpi {
namespace {

using test::world;

TEST(Ranks, SumsAndMaxima) {
  for (int n = 1; n <= world().count(); ++n) {
    const Ranks ranks = world().first(n);
    if (world().rank() < n) {
      EXPECT_EQ(ranks.count(), n);
      double sums[2] = {1.0 + ranks.rank(), 0.1}, most[2] = {double(ranks.rank()), -double(ranks.rank())};
      ranks.sum({sums, 2});
      ranks.max({most, 2});
      EXPECT_EQ(sums[0], n * (n + 1) / 2);
      double tenths = 0;
      for (int r = 0; r < n; ++r) tenths += 0.1;
      EXPECT_EQ(sums[1], tenths) << "added up in rank order";
      EXPECT_EQ(most[0], n - 1);
      EXPECT_EQ(most[1], 0);
    }
    test::barrier();
  }
}

TEST(Ranks, PartsOfAnyLengthArrive) {
  const auto bytes = [](int rank) { return std::vector<std::byte>(rank * 70000, std::byte(7 + rank)); };
  const auto all = world().gather(bytes(world().rank()));
  if (!world().root()) {
    EXPECT_TRUE(all.empty());
  }
  for (std::size_t r = 0; r < all.size(); ++r) EXPECT_TRUE(all[r] == bytes(static_cast<int>(r)));
  EXPECT_TRUE(world().scatter(all) == bytes(world().rank()));
  auto same = world().root() ? bytes(2) : std::vector<std::byte>{};
  world().broadcast(same);
  EXPECT_TRUE(same == bytes(2));
}

TEST(Ranks, FlagsReachAllAtTheSameCall) {
  const int last = world().count() - 1;
  std::vector<unsigned> heard;
  Agreement agreement(world());
  for (int call = 0; call < 6; ++call)
    heard.push_back(
        agreement.any((call == 2 && world().rank() == last ? 4 : 0) | (call == 3 && world().root() ? 1 : 0)));
  EXPECT_EQ(heard, (std::vector<unsigned>{0, 0, 0, 4, 1, 0}));
  EXPECT_EQ(Agreement(Ranks()).any(3), 3u) << "one rank does not wait for itself";
}

/// One rank fails while the others wait for a message that never comes.
template <class Wait>
void expect_all_to_hear(const Wait& wait) {
  const Ranks group = world().first(world().count());  // errors end a group: not the one of the other tests
  const int culprit = world().count() - 1;
  int code = 0;
  std::string text;
  try {
    group.guarded([&] {
      if (group.rank() == culprit) throw PhysicsError("cell 7 (rbc) is no longer finite");
      wait(group);
    });
  } catch (const Error& error) {
    code = static_cast<int>(error.code), text = error.what();
  }
  EXPECT_EQ(code, 3) << "rank " << group.rank();
  EXPECT_EQ(text, "cell 7 (rbc) is no longer finite");
  test::barrier();
}

TEST(Ranks, AnErrorEndsTheWaitOfAll) {
  if (world().count() == 1) GTEST_SKIP();
  expect_all_to_hear([](const Ranks& group) {
    double value = 1;
    group.sum({&value, 1});
  });
  expect_all_to_hear([](const Ranks& group) {
    std::vector<std::byte> large(1 << 22), other;
    Messages way(group);  // longer than what MPI sends unasked
    way.send(group.count() - 1, 5, {large.data(), large.size()});
    way.wait();
  });
  expect_all_to_hear([](const Ranks& group) {
    std::vector<std::byte> any;
    Messages way(group);
    way.receive(group.count() - 1, 5, any);
  });
}

TEST(Ranks, TheRootsErrorIsEverybodys) {
  const Ranks group = world().first(world().count());
  EXPECT_NO_THROW(group.on_root([] {}));
  test::barrier();  // else the root's error may reach those who still wait in the call before
  try {
    group.on_root([] { throw IoError("no space left"); });
    FAIL() << "nothing was thrown on rank " << group.rank();
  } catch (const Error& error) {
    EXPECT_EQ(static_cast<int>(error.code), 74);
  }
  test::barrier();
}

}  // namespace
}  // namespace hemowalk::mpi
