#include "calibration/tracks.hpp"

#include <algorithm>
#include <cmath>
#include <string>

#include "core/check.hpp"

namespace hemowalk::calibration {
namespace {

std::string text(double v) {
  char buffer[32];
  std::snprintf(buffer, sizeof buffer, "%.4g", v);
  return buffer;
}

double median_interval(const std::vector<double>& time) {
  std::vector<double> d;
  for (std::size_t i = 1; i < time.size(); ++i) d.push_back(time[i] - time[i - 1]);
  std::nth_element(d.begin(), d.begin() + static_cast<std::ptrdiff_t>(d.size() / 2), d.end());
  return d[d.size() / 2];
}

void check_times(const std::vector<double>& time) {
  require(time.size() >= 2, "trajectories hold " + std::to_string(time.size()) +
                                " sample(s) (displacements need at least two) record more samples");
  for (std::size_t i = 0; i < time.size(); ++i) {
    require(std::isfinite(time[i]), [&] {
      return "time of sample " + std::to_string(i) + " is not a number (damaged file?) write the run again";
    });
    require(i == 0 || time[i] > time[i - 1], [&] {
      return "times are not increasing (sample " + std::to_string(i) + ": " + text(time[i]) + " s after " +
             text(time[i - 1]) + " s) sort the samples and remove doubles";
    });
  }
}

void check_finite(const data::Tracks& tracks, std::size_t samples, const std::string& kind) {
  require(tracks.position.size() == samples * tracks.cells() * 3, [&] {
    return "positions of kind '" + kind + "' have " + std::to_string(tracks.position.size()) +
           " numbers (expected samples x cells x 3 = " + std::to_string(samples * tracks.cells() * 3) +
           ") write the file again";
  });
  const auto bad = std::find_if(tracks.position.begin(), tracks.position.end(),
                                [](double v) { return !std::isfinite(v); });
  require(bad == tracks.position.end(), [&] {
    const auto k = static_cast<std::size_t>(bad - tracks.position.begin()) / 3;
    return "position of " + kind + " " + std::to_string(tracks.id[k % tracks.cells()]) + " in sample " +
           std::to_string(k / tracks.cells()) +
           " is not a number (blow-up or damaged file?) end the run before it";
  });
}

/// Wrapped: no cell ever leaves a window of one box length, and some cell crosses half the box in one sample.
void check_unwrapped(const data::Tracks& tracks, std::size_t samples, int axis, double length) {
  if (!(length > 0)) return;
  double largest = 0, low = tracks.at(0, 0, axis), high = low;
  for (std::size_t t = 0; t < samples; ++t)
    for (std::size_t n = 0; n < tracks.cells(); ++n) {
      const double p = tracks.at(t, n, axis);
      low = std::min(low, p);
      high = std::max(high, p);
      if (t) largest = std::max(largest, std::abs(p - tracks.at(t - 1, n, axis)));
    }
  require(!(largest > length / 2 && high - low <= length * 1.0001), [&] {
    return std::string("positions along ") + "xyz"[axis] + " are wrapped (steps up to " +
           text(largest * 1e6) + " um while nobody leaves a box of " + text(length * 1e6) +
           " um) unwrap them with the periodic length before calibrating";
  });
}

void check_inside(const data::Tracks& tracks, std::size_t samples, const std::array<double, 2>& walls) {
  const double slack = 1e-9 + 1e-6 * (walls[1] - walls[0]);
  for (std::size_t t = 0; t < samples; ++t)
    for (std::size_t n = 0; n < tracks.cells(); ++n) {
      const double y = tracks.at(t, n, 1);
      require(y >= walls[0] - slack && y <= walls[1] + slack, [&] {
        return "cell " + std::to_string(tracks.id[n]) + " lies at y = " + text(y * 1e6) +
               " um (outside the walls " + text(walls[0] * 1e6) + " .. " + text(walls[1] * 1e6) +
               " um: lost cell or wrong walls) check walls_y and the run";
      });
    }
}

std::vector<Segment> regular_segments(const std::vector<double>& time, std::size_t origin, double interval) {
  std::vector<Segment> segments;
  std::size_t begin = origin;
  for (std::size_t i = origin + 1; i <= time.size(); ++i) {
    if (i < time.size() && std::abs(time[i] - time[i - 1] - interval) <= 1e-4 * interval) continue;
    if (i - begin >= 2) segments.push_back({begin, i});
    begin = i;
  }
  return segments;
}

Run lay_out(const data::Trajectories& source, const data::Tracks& tracks, std::size_t index, Ensemble& e) {
  Run run;
  run.time = source.time;
  run.origin = static_cast<std::size_t>(
      std::lower_bound(run.time.begin(), run.time.end(), e.t0 - 1e-6 * e.interval) - run.time.begin());
  run.segments = regular_segments(run.time, run.origin, e.interval);
  run.first = e.paths.size();
  run.last = run.first + tracks.cells();
  const std::size_t samples = run.time.size();
  for (std::size_t n = 0; n < tracks.cells(); ++n) {
    Path p;
    p.run = index;
    p.x.resize(samples);
    p.y.resize(samples);
    p.z.resize(samples);
    for (std::size_t t = 0; t < samples; ++t) {
      p.x[t] = tracks.at(t, n, 0);
      p.y[t] = tracks.at(t, n, 1);
      p.z[t] = tracks.at(t, n, 2);
    }
    e.paths.push_back(std::move(p));
  }
  return run;
}

}  // namespace

double Ensemble::window() const {
  double longest = 0;
  for (const auto& r : runs)
    if (r.origin < r.time.size()) longest = std::max(longest, r.time.back() - r.time[r.origin]);
  return longest;
}

int Ensemble::steps(double lag) const { return std::max(1, static_cast<int>(std::lround(lag / interval))); }

Ensemble gather(const std::vector<data::Trajectories>& runs, const Options& options) {
  require(!runs.empty(),
          "no trajectories given (nothing to calibrate) name a run, an HDF5 file or --import DIR");
  Ensemble e;
  e.t0 = options.t0;
  require(std::isfinite(e.t0) && e.t0 >= 0, "t0 is not a time (" + text(e.t0) + " s) give 0 or more");
  std::size_t cells = 0;
  for (std::size_t r = 0; r < runs.size(); ++r) {
    const auto& run = runs[r];
    const auto found = run.kinds.find(options.kind);
    require(found != run.kinds.end() && found->second.cells() > 0, [&] {
      std::string known;
      for (const auto& [name, tracks] : run.kinds) known += (known.empty() ? "" : ", ") + name;
      return "no trajectories of kind '" + options.kind +
             "' (the file holds: " + (known.empty() ? "none" : known) + ") choose one of these kinds";
    });
    const auto& tracks = found->second;
    check_times(run.time);
    check_finite(tracks, run.time.size(), options.kind);
    for (int axis : {0, 2})
      check_unwrapped(tracks, run.time.size(), axis, run.box[static_cast<std::size_t>(axis)]);
    require(run.walls_y[1] > run.walls_y[0],
            "the run has no walls along y (walls_y = " + text(run.walls_y[0]) + ", " + text(run.walls_y[1]) +
                " m) calibrate a slab");
    check_inside(tracks, run.time.size(), run.walls_y);
    const double interval = median_interval(run.time);
    if (r == 0) {
      e.interval = interval;
      e.walls = run.walls_y;
      e.height = run.box[1] > 0 ? run.box[1] : run.walls_y[1] - run.walls_y[0];
      e.shear_rate = run.shear_rate;
    }
    require(std::abs(interval - e.interval) <= 1e-4 * e.interval &&
                std::abs(run.walls_y[1] - run.walls_y[0] - (e.walls[1] - e.walls[0])) <= 1e-6 * e.height,
            "run " + std::to_string(r + 1) +
                " differs from the first in sampling interval or gap (replicas share one scene) calibrate "
                "them apart");
    e.runs.push_back(lay_out(run, tracks, r, e));
    cells += tracks.cells();
  }
  require(cells >= 2,
          "only one " + options.kind + " (no spread, so no error can be stated) give at least two");
  require(e.window() >= 40 * e.interval &&
              std::any_of(e.runs.begin(), e.runs.end(), [](const Run& r) { return !r.segments.empty(); }),
          "too short a run (" + text(e.window()) + " s after t0 = " + text(e.t0) + " s, sampled every " +
              text(e.interval) + " s; at least 40 samples are needed) run longer, or lower t0");
  return e;
}

Layer rbc_rich_layer(const std::vector<data::Trajectories>& runs, double t0) {
  std::vector<double> y, h;
  for (const auto& run : runs) {
    const auto& p = run.profile;
    const std::size_t ny = p.y.size();
    if (ny < 6 || p.hematocrit.size() != p.time.size() * ny) return {};
    if (y.empty()) {
      y = p.y;
      h.assign(ny, 0);
    }
    if (p.y.size() != y.size()) return {};
    for (std::size_t k = 0; k < p.time.size(); ++k)
      if (p.time[k] >= t0)
        for (std::size_t j = 0; j < ny; ++j) h[j] += p.hematocrit[k * ny + j];
  }
  if (y.empty()) return {};
  const std::size_t n = y.size();
  double core = 0;
  for (std::size_t j = n / 3; j < n - n / 3; ++j) core += h[j] / static_cast<double>(n - 2 * (n / 3));
  if (!(core > 0)) return {};
  const double half = core / 2;
  Layer layer{y.front(), y.back()};
  for (std::size_t j = n / 2; j > 0; --j)
    if (h[j - 1] < half) {
      layer.low = y[j] - (y[j] - y[j - 1]) * (h[j] - half) / (h[j] - h[j - 1]);
      break;
    }
  for (std::size_t j = n / 2; j + 1 < n; ++j)
    if (h[j + 1] < half) {
      layer.high = y[j] + (y[j + 1] - y[j]) * (h[j] - half) / (h[j] - h[j + 1]);
      break;
    }
  return layer;
}

namespace {
Layer fixed_layer(const std::vector<data::Trajectories>& runs, const Ensemble& e, double share, double most) {
  const Layer rich = rbc_rich_layer(runs, e.t0);
  if (rich.high > rich.low) return rich;
  const double middle = (e.walls[0] + e.walls[1]) / 2, off = std::min(share * e.height, most);
  return {middle - e.height / 2 + off, middle + e.height / 2 - off};
}
}  // namespace

Layer core_layer(const std::vector<data::Trajectories>& runs, const Ensemble& e, const Options& options) {
  if (!options.core) return fixed_layer(runs, e, 0.2, 10e-6);
  const Layer layer{(*options.core)[0], (*options.core)[1]};
  require(layer.high > layer.low && layer.high > e.walls[0] && layer.low < e.walls[1],
          "core layer " + text(layer.low * 1e6) + " .. " + text(layer.high * 1e6) +
              " um is empty (walls at " + text(e.walls[0] * 1e6) + " and " + text(e.walls[1] * 1e6) +
              " um) give low:high inside the walls");
  return layer;
}

Layer paper_layer(const std::vector<data::Trajectories>& runs, const Ensemble& e) {
  return fixed_layer(runs, e, 0.1, 5e-6);
}

}  // namespace hemowalk::calibration
