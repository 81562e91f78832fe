#include <cmath>
#include <nlohmann/json.hpp>

#include "coarse/simulation.hpp"
#include "core/hdf5.hpp"
#include "core/io.hpp"
#include "core/provenance.hpp"

namespace hemowalk::coarse {

namespace {

using Json = nlohmann::ordered_json;

Json number(double x) { return std::isfinite(x) ? Json(x) : Json(nullptr); }
Json numbers(const std::vector<double>& values) {
  Json list = Json::array();
  for (const double x : values) list.push_back(number(x));
  return list;
}

}  // namespace

std::string to_json(const Result& r, const Case& c) {
  Json j;
  j["format"] = "hemowalk.coarse/1";
  j["version"] = version();
  j["input_sha256"] = c.input_sha256;
  j["seed"] = c.seed;
  j["warnings"] = r.warnings;
  j["name"] = c.name;
  j["method"] = r.method;
  j["reason"] = r.reason;
  j["time_s"] = numbers(r.time);
  j["absorbed_fraction"] = numbers(r.absorbed_fraction);
  j["absorbed_sigma"] = numbers(r.absorbed_sigma);
  j["absorbed_law_sigma"] = numbers(r.absorbed_law_sigma);
  j["trapped_fraction"] = numbers(r.trapped_fraction);
  const std::size_t bins = r.profile.y.size();
  Json rows = Json::array();
  for (std::size_t t = 0; t < r.time.size(); ++t) {
    const auto row = r.profile.c.begin() + static_cast<std::ptrdiff_t>(t * bins);
    rows.push_back(numbers(std::vector<double>(row, row + static_cast<std::ptrdiff_t>(bins))));
  }
  j["profile"] = {{"y_m", numbers(r.profile.y)}, {"c", rows}};
  if (!r.flow.mean_z.empty())
    j["flow"] = {{"mean_z_m", numbers(r.flow.mean_z)}, {"variance_z_m2", numbers(r.flow.variance_z)}};
  j["walkers"] = r.walkers > 0 ? Json(r.walkers) : Json(nullptr);
  j["walker_steps_per_s"] = r.walker_steps_per_s > 0 ? number(r.walker_steps_per_s) : Json(nullptr);
  j["wall_s"] = number(r.wall);
  return j.dump(2);
}

void write_result(const Result& r, const Case& c, const std::string& path) {
  AtomicFile target(path);
  hdf5::File file = hdf5::File::create(target.temporary());
  file.write_attribute("format", "hemowalk.coarse/1");
  file.write_attribute("version", version());
  file.write_attribute("input_sha256", c.input_sha256);
  file.write_attribute("case_yaml", c.source_text);
  file.write_attribute("seed", c.seed);
  file.write_attribute("method", r.method);
  file.write_attribute("reason", r.reason);
  file.write_attribute("walkers", static_cast<std::uint64_t>(r.walkers));
  file.write_attribute("height", c.height);
  file.write_attribute("dt", c.dt);
  file.write_attribute("shear_rate", c.shear_rate);
  std::string warnings;
  for (const auto& w : r.warnings) warnings += w + "\n";
  file.write_attribute("warnings", warnings);
  const std::size_t T = r.time.size(), Y = r.profile.y.size();
  file.write("/time", {T}, r.time, "s");
  file.write("/absorbed_fraction", {T}, r.absorbed_fraction, "1");
  file.write("/absorbed_sigma", {T}, r.absorbed_sigma, "1");
  file.write("/absorbed_law_sigma", {T}, r.absorbed_law_sigma, "1");
  file.write("/trapped_fraction", {T}, r.trapped_fraction, "1");
  file.write("/profile/y", {Y}, r.profile.y, "m");
  file.write("/profile/c", {T, Y}, r.profile.c, "1");
  if (!r.flow.mean_z.empty()) {
    file.write("/flow/mean_z", {T}, r.flow.mean_z, "m");
    file.write("/flow/variance_z", {T}, r.flow.variance_z, "m2");
  }
  file.close();
  target.commit();
}

}  // namespace hemowalk::coarse
