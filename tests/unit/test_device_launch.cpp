// The launch layer on the host: every thread once, phases as barriers, recorded work. The functors here are
// not compiled for a device, those of support/launch_kernels.cpp are.

#include <gtest/gtest.h>

#include <numeric>

#include "support/launch_kernels.hpp"
#include "support/places.hpp"

namespace hemowalk {
namespace {

TEST(Devices, RanksOfAMachineTakeTurns) {
  const std::pair<const char*, std::string> launchers[] = {{"SLURM_LOCALID", "3"},
                                                           {"OMPI_COMM_WORLD_LOCAL_RANK", "5"}};
  for (const auto& [name, value] : launchers) unsetenv(name);
  EXPECT_EQ(device_of_process(4), 0);
  for (const auto& [name, value] : launchers) {  // mpirun inside a Slurm job: Open MPI's number counts
    setenv(name, value.c_str(), 1);
    EXPECT_EQ(device_of_process(4), std::stoi(value) % 4);
    EXPECT_EQ(device_of_process(1), 0);
  }
  // From the first device of their run on.
  setenv("HEMOWALK_DEVICE", "6", 1);
  EXPECT_EQ(device_of_process(16), 11);
  EXPECT_EQ(device_of_process(4), 3);
  setenv("HEMOWALK_DEVICE", "-1", 1);
  EXPECT_EQ(device_of_process(16), 5);
  unsetenv("HEMOWALK_DEVICE");
  for (const auto& [name, value] : launchers) unsetenv(name);
}

constexpr HostThreads orders[] = {HostThreads::forward, HostThreads::backward, HostThreads::scattered};

struct CountVisits {
  unsigned* visits;
  void operator()(std::size_t i) const { atomic_add(visits + i, 1); }
};

// Each block sums its share: every thread leaves a number, the first adds them in the next phase.
struct BlockSum {
  static constexpr int threads = 96;
  const int* value;
  std::int64_t* sum;
  int phases() const { return 2; }
  void operator()(int phase, BlockThread at, unsigned char* shared) const {
    int* part = reinterpret_cast<int*>(shared);
    if (phase == 0) part[at.thread] = value[at.block * threads + at.thread];
    if (phase == 1 && at.thread == 0) {
      std::int64_t total = 0;
      for (int t = 0; t < threads; ++t) total += part[t];
      sum[at.block] = total;
    }
  }
};

// Wrong on purpose: a thread reads what its neighbour writes in the same phase.
struct Racing {
  static constexpr int threads = 32;
  int* out;
  int phases() const { return 2; }
  void operator()(int phase, BlockThread at, unsigned char* shared) const {
    int* part = reinterpret_cast<int*>(shared);
    const unsigned t = at.thread;
    if (phase == 0) part[t] = 0;
    if (phase == 1) {
      part[t] = 1;
      out[t] = part[(t + 1) % threads];
    }
  }
};

TEST(Launch, ForEachVisitsEveryIndexOnce) {
  Queue queue(Place::host);
  for (const HostThreads order : orders) {
    test::ThreadOrder now(order);
    Array<unsigned> visits(1001);
    queue.for_each(visits.size(), CountVisits{visits.data()});
    for (const unsigned n : visits) EXPECT_EQ(n, 1u);
  }
}

TEST(Launch, PhasesAreBarriersInAnyOrderOfThreads) {
  Queue queue(Place::host);
  Array<int> value(7 * BlockSum::threads);
  for (std::size_t i = 0; i < value.size(); ++i) value[i] = static_cast<int>(i * i % 101);
  for (const HostThreads order : orders) {
    test::ThreadOrder now(order);
    Array<std::int64_t> sum(7);
    queue.blocks(7, BlockSum::threads * sizeof(int), BlockSum{value.data(), sum.data()});
    for (std::size_t b = 0; b < 7; ++b) {
      std::int64_t expected = 0;
      for (std::size_t t = 0; t < BlockSum::threads; ++t) expected += value[b * BlockSum::threads + t];
      EXPECT_EQ(sum[b], expected);
    }
  }
}

// What makes the comparison of orders a test for races: it finds one.
TEST(Launch, ThreadsThatMeetWithinAPhaseShowInTheirOrder) {
  Queue queue(Place::host);
  const auto outcome = [&](HostThreads order) {
    test::ThreadOrder now(order);
    Array<int> out(Racing::threads);
    queue.blocks(1, Racing::threads * sizeof(int), Racing{out.data()});
    return std::vector<int>(out.begin(), out.end());
  };
  EXPECT_NE(outcome(HostThreads::forward), outcome(HostThreads::backward));
}

// Wrong on purpose: a block takes what the one before it has left.
struct RacingBlocks {
  static constexpr int threads = 1;
  int* out;
  int phases() const { return 1; }
  void operator()(int, BlockThread at, unsigned char*) const {
    out[at.block] = at.block == 0 ? 1 : out[at.block - 1] + 1;
  }
};

TEST(Launch, BlocksThatMeetShowInTheirOrder) {
  Queue queue(Place::host);
  const int before = omp_get_max_threads();
  omp_set_num_threads(1);
  const auto outcome = [&](HostThreads order) {
    test::ThreadOrder now(order);
    Array<int> out(5);
    queue.blocks(5, 0, RacingBlocks{out.data()});
    return std::vector<int>(out.begin(), out.end());
  };
  EXPECT_EQ(outcome(HostThreads::forward), (std::vector<int>{1, 2, 3, 4, 5}));
  for (const HostThreads order : {HostThreads::backward, HostThreads::scattered})
    EXPECT_EQ(outcome(order), (std::vector<int>{1, 1, 1, 1, 1}));
  omp_set_num_threads(before);
}

TEST(Launch, ScatteredOrderIsAPermutation) {
  for (const unsigned n : {1u, 32u, 96u, 288u, 1024u}) {
    std::vector<int> seen(n, 0);
    for (unsigned i = 0; i < n; ++i) ++seen.at(detail::host_thread(i, n, HostThreads::scattered));
    for (const int s : seen) EXPECT_EQ(s, 1);
  }
}

TEST(Launch, RecordedWorkRunsWhenReplayedOnly) {
  Queue queue(Place::host);
  Array<unsigned> visits(10);
  const Graph graph = queue.record([&] {
    queue.for_each(visits.size(), CountVisits{visits.data()});
    queue.for_each(5, CountVisits{visits.data()});
  });
  EXPECT_EQ(graph.size(), 2u);
  EXPECT_EQ(visits[0], 0u);
  queue.replay(graph);
  queue.replay(graph);
  EXPECT_EQ(visits[0], 4u);
  EXPECT_EQ(visits[9], 2u);
  queue.for_each(1, CountVisits{visits.data()});  // recording has ended
  EXPECT_EQ(visits[0], 5u);
}

TEST(Launch, BlocksThatNoDeviceHoldsAreAnInputError) {
  Queue queue(Place::host);
  EXPECT_NO_THROW(queue.require_shared_memory(227 * 1024));
  EXPECT_THROW(queue.require_shared_memory(227 * 1024 + 1), InputError);
}

class LaunchTest : public test::OnPlace {};
HEMOWALK_ON_BOTH_PLACES(LaunchTest);

TEST_P(LaunchTest, BlocksWorkTogetherThroughLargeSharedMemory) {
  constexpr std::size_t n = test::reversed_length, blocks = 3;
  Queue queue(GetParam());
  queue.require_shared_memory(n * sizeof(int));
  std::vector<int> values(blocks * n);
  std::iota(values.begin(), values.end(), 0);
  Array<int> there = make_array(GetParam(), values);
  test::reverse_pieces(queue, there.data(), blocks);
  queue.wait();
  const auto back = place_copy(Place::host, there);
  for (std::size_t b = 0; b < blocks; ++b)
    for (std::size_t i = 0; i < n; ++i) ASSERT_EQ(back[b * n + i], static_cast<int>(b * n + n - 1 - i));
}

// A graph holds addresses, not values: what lies in pinned memory when it is replayed goes up, through both
// kernels, and down.
TEST_P(LaunchTest, GraphsReplayKernelsAndCopies) {
  constexpr std::size_t n = test::reversed_length;
  Queue queue(GetParam());
  PinnedArray<int> up(GetParam(), n), down(GetParam(), n);
  Array<int> there(n, GetParam());
  const Graph graph = queue.record([&] {
    queue.copy(there.data(), std::as_const(up).data(), n);
    test::add_one(queue, there.data(), n);
    test::reverse_pieces(queue, there.data(), 1);
    queue.copy(down.data(), std::as_const(there).data(), n);
  });
  EXPECT_EQ(graph.size(), 4u);
  EXPECT_EQ(down[0], 0) << "nothing is done while it is recorded";
  for (const int from : {0, 1000}) {
    for (std::size_t i = 0; i < n; ++i) up[i] = from + static_cast<int>(i);
    queue.replay(graph);
    queue.wait();
    for (std::size_t i = 0; i < n; ++i) ASSERT_EQ(down[i], from + static_cast<int>(n - i));
  }
}

// What a device refuses while work is recorded must not leave the queue recording.
TEST_P(LaunchTest, WorkThatThrowsIsNotKept) {
  Queue queue(GetParam());
  Array<int> there(3, GetParam());
  EXPECT_THROW((void)queue.record([&] {
    test::add_one(queue, there.data(), 3);
    throw InputError("no");
  }),
               InputError);
  test::add_one(queue, there.data(), 1);  // done at once
  queue.wait();
  EXPECT_EQ(place_copy(Place::host, there)[0], 1);
  EXPECT_EQ(queue.record([&] { test::add_one(queue, there.data(), 1); }).size(), 1u);
}

TEST(Launch, IntegerAtomics) {
  std::int64_t sum = 5;
  atomic_add(&sum, -8);
  EXPECT_EQ(sum, -3);
  int least = 4;
  atomic_min(&least, 7);
  EXPECT_EQ(least, 4);
  atomic_min(&least, -2);
  EXPECT_EQ(least, -2);
}

TEST(Launch, ArraysGrowAndKeepWhatTheyHold) {
  Queue queue(Place::host);
  Array<int> array;
  queue.fit(array, 3);
  EXPECT_EQ(array.size(), 3u);
  queue.upload(array, {7, 8, 9});
  queue.fit(array, 2);
  EXPECT_EQ(array.size(), 3u);
  queue.fit(array, 8);
  EXPECT_EQ(array.size(), 10u) << "room for a quarter more";
  EXPECT_EQ(array[2], 9);
}

TEST(Launch, PinnedArraysGrowAndKeepWhatTheyHold) {
  PinnedArray<int> array(Place::host, 3);
  array[2] = 9;
  const int* before = array.data();
  array.fit(3);
  EXPECT_EQ(array.data(), before) << "pinned once";
  array.fit(8);
  EXPECT_EQ(array.size(), 10u);
  EXPECT_EQ(array[2], 9);
}

TEST(Launch, AskingForAMissingDeviceIsAnInputError) {
  if (device_present()) GTEST_SKIP() << "there is a device";
  EXPECT_THROW(Queue(Place::device), InputError);
}

}  // namespace
}  // namespace hemowalk
