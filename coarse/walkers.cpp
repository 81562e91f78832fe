#include "coarse/walkers.hpp"

#include <fmt/format.h>
#include <omp.h>

#include <algorithm>
#include <cmath>
#include <ctime>

#include "core/check.hpp"

namespace hemowalk::coarse {

namespace {

using Wide = Lanes<16>;

}  // namespace

Walkers::Walkers(const Case& c, const SlabLaw& law, const WalkSettings& settings)
    : size_(c.walkers), height_(c.height), dt_(c.dt), shear_rate_(c.shear_rate) {
  WalkTables tables = make_walk(c, law, settings);
  table_ = tables.table;
  variance_ = Array<float>(tables.variance.size());
  drift_ = Array<float>(tables.drift.size());
  std::copy(tables.variance.begin(), tables.variance.end(), variance_.begin());
  std::copy(tables.drift.begin(), tables.drift.end(), drift_.begin());
  model_ = tables.model;
  model_.variance = variance_.data();
  model_.drift = tables.drifts ? drift_.data() : nullptr;

  const std::int64_t n_blocks = (size_ + block - 1) / block;
  y_ = Array<std::int32_t>(n_blocks * block);
  offset_ = Array<std::uint16_t>(n_blocks * block);
  if (settings.step_law == StepLaw::persistent) memory_ = Array<float>(n_blocks * block);
  if (settings.track_flow_direction) way_ = Array<std::int64_t>(n_blocks * block);
  active_.assign(n_blocks, block);
  absorbed_.assign(n_blocks, {0, 0});
  active_.back() = static_cast<std::int32_t>(size_ - (n_blocks - 1) * block);
#pragma omp parallel for schedule(static)
  for (std::int64_t i = 0; i < n_blocks * block; ++i) {
    y_[i] = i < size_ ? initial_position(model_, static_cast<std::uint64_t>(i)) : state::nobody;
    offset_[i] = static_cast<std::uint16_t>(i % block);
    if (memory_.size()) memory_[i] = normal4(random_bits(c.seed, Stream::initial, i, 1)).value[0];
  }
}

template <StepLaw S, bool Table, bool Drift>
void Walkers::walk_block(std::int64_t b, std::int64_t begin, std::int64_t end) {
  using Int = Wide::Int;
  using Bits = Wide::Bits;
  using Real = Wide::Real;
  for (int i = 0; i < active_[b]; i += width * sets) {
    const std::int64_t at = b * block + i;
    LaneState<Wide> w[sets];
    for (int j = 0; j < sets; ++j) {
      const std::int64_t here = at + j * width;
      const Int stored = load<std::int32_t, width>(&y_[here]);
      const auto walking = stored >= Int(0);
      w[j].code = select(walking, Int(0), stored);
      w[j].y = select(walking, stored, Int(top_position / 2));
      w[j].memory = S == StepLaw::persistent ? load<float, width>(&memory_[here]) : Real(0);
      w[j].offset = Bits([&](auto lane) { return std::uint32_t{offset_[here + lane]}; });
    }
    if (way_.size() == 0) {
      walk_steps<Wide, S, Table, Drift>(model_, w, b * block, begin, end, [](auto&&...) {});
    } else {
      walk_steps<Wide, S, Table, Drift>(model_, w, b * block, begin, end, [&](int j, const Int& before) {
        alignas(64) std::int32_t both[width];
        store<std::int32_t, width>(before + w[j].y - Int(top_position), both);
        for (int l = 0; l < width; ++l) way_[at + j * width + l] += both[l];
      });
    }
    for (int j = 0; j < sets; ++j) {
      const std::int64_t here = at + j * width;
      store<std::int32_t, width>(select(w[j].code == Int(0), w[j].y, w[j].code), &y_[here]);
      if (S == StepLaw::persistent) store<float, width>(w[j].memory, &memory_[here]);
    }
  }
}

void Walkers::compact(std::int64_t b) {
  std::int32_t kept = 0;
  for (std::int64_t i = b * block; i < b * block + active_[b]; ++i) {
    const std::int32_t y = y_[i];
    if (state::is_absorbed(y)) {
      ++absorbed_[b][y == state::absorbed_bottom ? 0 : 1];
      continue;
    }
    if (y == state::nobody) continue;
    const std::int64_t to = b * block + kept++;
    y_[to] = y;
    offset_[to] = offset_[i];
    if (memory_.size()) memory_[to] = memory_[i];
  }
  active_[b] = kept;
  for (std::int64_t i = b * block + kept; i % (width * sets) != 0; ++i) y_[i] = state::nobody;
}

void Walkers::advance_to(std::int64_t step) {
  const bool takes = model_.bottom.active() || model_.top.active();
  walk_legs(model_, table_, step_, step, [&](auto kind, std::int64_t begin, std::int64_t end) {
    std::int64_t walked = 0;
#pragma omp parallel for schedule(dynamic, 1) reduction(+ : walked) if (blocks() > 1)
    for (std::int64_t b = 0; b < blocks(); ++b) {
      walked += active_[b] * (end - begin);
      walk_block<kind.step_law, kind.table, kind.drift>(b, begin, end);
      if (takes && way_.size() == 0) compact(b);
    }
    steps_walked_ += walked;
  });
}

WalkCounts Walkers::count(int bins) const {
  WalkCounts total;
  total.histogram.assign(bins, 0);
#pragma omp parallel if (blocks() > 64)
  {
    WalkCounts mine;
    mine.histogram.assign(bins, 0);
#pragma omp for schedule(static)
    for (std::int64_t b = 0; b < blocks(); ++b) {
      for (int side = 0; side < 2; ++side) mine.absorbed[side] += absorbed_[b][side];
      for (std::int64_t i = b * block; i < b * block + active_[b]; ++i) {
        const std::int64_t y = y_[i];
        if (y >= 0)
          ++mine.histogram[std::min<std::int64_t>(y * bins >> 30, bins - 1)];
        else if (state::is_trapped(static_cast<std::int32_t>(y)))
          ++mine.trapped[-y % 2];
        else if (state::is_absorbed(static_cast<std::int32_t>(y)))
          ++mine.absorbed[y == state::absorbed_bottom ? 0 : 1];
      }
    }
#pragma omp critical
    {
      for (int side = 0; side < 2; ++side) {
        total.absorbed[side] += mine.absorbed[side];
        total.trapped[side] += mine.trapped[side];
      }
      for (int k = 0; k < bins; ++k) total.histogram[k] += mine.histogram[k];
    }
  }
  return total;
}

Walkers::Spread Walkers::spread() const {
  require(way_.size() > 0, "the way along the flow was not tracked (it costs 8 bytes per walker) ask for it");
  // way = sum of (y0 + y1 - height): twice the sum of the mid-step positions, seen from the middle of the
  // slab
  const double unit = shear_rate_ * dt_ * height_ / top_position / 2;
  std::vector<std::array<double, 2>> sums(blocks());
#pragma omp parallel for schedule(static)
  for (std::int64_t b = 0; b < blocks(); ++b)
    for (std::int64_t i = b * block; i < b * block + active_[b]; ++i) {
      const double z = unit * static_cast<double>(way_[i]);
      sums[b][0] += z;
      sums[b][1] += z * z;
    }
  double s1 = 0, s2 = 0;
  for (const auto& s : sums) {
    s1 += s[0];
    s2 += s[1];
  }
  const double n = static_cast<double>(size_), mean = s1 / n;
  return {mean + shear_rate_ * height_ / 2 * dt_ * static_cast<double>(step_), s2 / n - mean * mean};
}

std::vector<double> Walkers::heights() const {
  std::vector<double> result;
  for (std::int64_t b = 0; b < blocks(); ++b)
    for (std::int64_t i = b * block; i < b * block + active_[b]; ++i)
      if (y_[i] >= 0) result.push_back(height_ * y_[i] / top_position);
  return result;
}

double normal_numbers_per_second(double seconds) {
  const auto processor_time = [] {  // of this thread: what others on the machine do does not count
    timespec t;
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
    return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
  };
  double rate = 0;
  float sink = 0;
#pragma omp parallel reduction(+ : rate, sink)
  {
    const Wide::Bits offset([](auto l) { return std::uint32_t(l); });
    Wide::Real sum = 0;
    std::int64_t step = 0;
    const double start = processor_time();
    double spent = 0;
    while (spent < seconds) {
      for (int i = 0; i < 4096; ++i, ++step) {
        const auto words = lane_bits<Wide>(1, Stream::coarse_walk, 16 * omp_get_thread_num(), offset, step);
        for (int k = 0; k < 2; ++k) {
          const NormalPair<Wide> p(words.word[2 * k], words.word[2 * k + 1]);
          const auto radius = stdx::sqrt(p.square);
          sum += radius * p.cosine + radius * p.sine;
        }
      }
      spent = processor_time() - start;
    }
    rate += 4.0 * Wide::width * static_cast<double>(step) / spent;
    sink += stdx::reduce(sum);
  }
  return std::isfinite(sink) ? rate : 0;
}

}  // namespace hemowalk::coarse
