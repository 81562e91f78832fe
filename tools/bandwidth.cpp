#include "tools/bandwidth.hpp"

#include <algorithm>

namespace hemowalk {

namespace {

struct alignas(16) Four {
  float x, y, z, w;
};
struct Scale {
  Four* data;
  HEMO_HD void operator()(std::size_t i) const {
    Four f = data[i];
    f.x = 0.5f * f.x + 1, f.y = 0.5f * f.y + 1, f.z = 0.5f * f.z + 1, f.w = 0.5f * f.w + 1;
    data[i] = f;
  }
};

}  // namespace

double measure_bandwidth(Queue& queue, std::size_t bytes, int repetitions) {
  const std::size_t n = bytes / sizeof(Four);
  Array<Four> data(n, queue.place());
  queue.for_each(n, Scale{data.data()});
  std::vector<double> rate;
  for (int i = 0; i < repetitions; ++i) {
    const auto start = queue.now();
    queue.for_each(n, Scale{data.data()});
    const auto end = queue.now();
    queue.wait();
    rate.push_back(2.0 * static_cast<double>(n * sizeof(Four)) / end.seconds_since(start));
  }
  std::sort(rate.begin(), rate.end());
  return rate[rate.size() / 2];
}

}  // namespace hemowalk
