#include "coarse/device_walkers.hpp"

#include <numeric>

namespace hemowalk::coarse {

namespace {

using One = Lanes<1>;

/// Initial positions and velocities, as Walkers draws them.
struct Scatter {
  WalkModel model;
  std::int32_t* y;
  float* memory;  ///< null: no velocities
  HEMO_HD void operator()(std::size_t i) const {
    y[i] = initial_position(model, i);
    if (memory) memory[i] = normal4(random_bits(model.seed, Stream::initial, i, 1)).value[0];
  }
};

struct Ignore {
  HEMO_HD void operator()(int, std::int32_t) const {}
};

constexpr std::size_t counters = 1024;  ///< of steps: so many that few threads meet at one

/// Steps [begin, end) of one walker, in registers.
template <StepLaw S, bool Table, bool Drift>
struct Walk {
  WalkModel model;
  std::int64_t begin, end;
  std::int32_t* y;
  float* memory;
  std::int64_t* walked;  ///< [counters]

  HEMO_HD void operator()(std::size_t i) const {
    const std::int32_t stored = y[i];
    if (state::is_absorbed(stored)) return;
    atomic_add(walked + i % counters, end - begin);
    LaneState<One> w[1];
    w[0].code = stored >= 0 ? 0 : stored;
    w[0].y = stored >= 0 ? stored : top_position / 2;
    w[0].memory = S == StepLaw::persistent ? memory[i] : 0.0f;
    w[0].offset = 0;
    walk_steps<One, S, Table, Drift>(model, w, i, begin, end, Ignore{});
    y[i] = w[0].code == 0 ? w[0].y : w[0].code;
    if (S == StepLaw::persistent) memory[i] = w[0].memory;
  }
};

/// Integer counts: [absorbed 2][trapped 2][bins].
struct Count {
  const std::int32_t* y;
  int bins;
  std::int64_t* count;
  HEMO_HD void operator()(std::size_t i) const {
    const std::int64_t at = y[i];
    if (at >= 0) {
      const std::int64_t bin = at * bins >> 30;
      atomic_add(count + 4 + (bin < bins ? bin : bins - 1), 1);
    } else if (state::is_trapped(y[i])) {
      atomic_add(count + 2 + -at % 2, 1);
    } else if (state::is_absorbed(y[i])) {
      atomic_add(count + (at == state::absorbed_bottom ? 0 : 1), 1);
    }
  }
};

}  // namespace

DeviceWalkers::DeviceWalkers(Queue& queue, const WalkTables& walk, std::int64_t count)
    : queue_(queue),
      size_(count),
      table_(walk.table),
      model_(walk.model),
      variance_(make_array(queue.place(), walk.variance)),
      drift_(make_array(queue.place(), walk.drift)),
      y_(static_cast<std::size_t>(count), queue.place()),
      walked_(counters, queue.place()) {
  model_.variance = variance_.data();
  model_.drift = walk.drifts ? drift_.data() : nullptr;
  if (model_.step_law == StepLaw::persistent)
    memory_ = Array<float>(static_cast<std::size_t>(count), queue.place());
  queue_.for_each(y_.size(), Scatter{model_, y_.data(), memory_.size() ? memory_.data() : nullptr});
}

void DeviceWalkers::advance_to(std::int64_t step) {
  walk_legs(model_, table_, step_, step, [&](auto kind, std::int64_t begin, std::int64_t end) {
    queue_.for_each(y_.size(), Walk<kind.step_law, kind.table, kind.drift>{model_, begin, end, y_.data(),
                                                                           memory_.data(), walked_.data()});
  });
}

std::int64_t DeviceWalkers::steps_walked() const {
  std::vector<std::int64_t> values(counters);
  queue_.copy(values.data(), walked_.data(), counters);
  queue_.wait();
  return std::accumulate(values.begin(), values.end(), std::int64_t{0});
}

WalkCounts DeviceWalkers::count(int bins) const {
  Array<std::int64_t> placed(static_cast<std::size_t>(bins) + 4, queue_.place());
  queue_.for_each(y_.size(), Count{y_.data(), bins, placed.data()});
  std::vector<std::int64_t> values(placed.size());
  queue_.copy(values.data(), placed.data(), values.size());
  queue_.wait();
  WalkCounts counts;
  for (std::size_t side = 0; side < 2; ++side)
    counts.absorbed[side] = values[side], counts.trapped[side] = values[2 + side];
  counts.histogram.assign(values.begin() + 4, values.end());
  return counts;
}

std::vector<std::int32_t> DeviceWalkers::positions() const {
  std::vector<std::int32_t> y(y_.size());
  queue_.copy(y.data(), y_.data(), y.size());
  queue_.wait();
  return y;
}

}  // namespace hemowalk::coarse
