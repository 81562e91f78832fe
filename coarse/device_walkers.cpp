#include "coarse/device_walkers.hpp"

#include <algorithm>

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

/// Steps [begin, end) of one walker, in registers.
template <StepLaw S, bool Table, bool Drift>
struct Walk {
  WalkModel model;
  std::int64_t begin, end;
  std::int32_t* y;
  float* memory;

  HEMO_HD void operator()(std::size_t i) const {
    const std::int32_t stored = y[i];
    if (state::is_absorbed(stored)) return;
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
      y_(static_cast<std::size_t>(count), queue.place()) {
  model_.variance = variance_.data();
  model_.drift = walk.drifts ? drift_.data() : nullptr;
  if (model_.step_law == StepLaw::persistent)
    memory_ = Array<float>(static_cast<std::size_t>(count), queue.place());
  queue_.for_each(y_.size(), Scatter{model_, y_.data(), memory_.size() ? memory_.data() : nullptr});
}

template <StepLaw S>
void DeviceWalkers::walk_leg(std::int64_t begin, std::int64_t end) {
  if (!table_)
    queue_.for_each(y_.size(), Walk<S, false, false>{model_, begin, end, y_.data(), memory_.data()});
  else if (!model_.drift)
    queue_.for_each(y_.size(), Walk<S, true, false>{model_, begin, end, y_.data(), memory_.data()});
  else
    queue_.for_each(y_.size(), Walk<S, true, true>{model_, begin, end, y_.data(), memory_.data()});
}

void DeviceWalkers::advance_to(std::int64_t step) {
  constexpr std::int64_t leg = 512;  // absorbed walkers leave their warp between legs
  while (step_ < step) {
    const std::int64_t end = std::min(step_ + leg, step);
    switch (model_.step_law) {
      case StepLaw::gaussian:
        walk_leg<StepLaw::gaussian>(step_, end);
        break;
      case StepLaw::persistent:
        walk_leg<StepLaw::persistent>(step_, end);
        break;
      case StepLaw::heavy_tail:
        walk_leg<StepLaw::heavy_tail>(step_, end);
        break;
    }
    step_ = end;
  }
}

DeviceWalkers::Counts DeviceWalkers::count(int bins) const {
  Array<std::int64_t> placed(static_cast<std::size_t>(bins) + 4, queue_.place());
  queue_.for_each(y_.size(), Count{y_.data(), bins, placed.data()});
  std::vector<std::int64_t> values(placed.size());
  queue_.copy(values.data(), placed.data(), values.size());
  queue_.wait();
  Counts counts;
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
