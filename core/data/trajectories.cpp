#include "core/data/trajectories.hpp"

#include <cmath>
#include <limits>
#include <set>
#include <utility>

#include "core/check.hpp"
#include "core/hdf5.hpp"
#include "core/io.hpp"
#include "core/provenance.hpp"
#include "core/units.hpp"

namespace hemowalk::data {
namespace {

constexpr const char* format_name = "hemowalk.trajectories/1";
constexpr double unknown = std::numeric_limits<double>::quiet_NaN();

/// Unit of a per-cell observable; "1" for names this version does not know.
std::string observable_units(const std::string& name) {
  static const std::map<std::string, std::string> units{{"taylor_deformation", "1"},
                                                        {"axial_diameter", "m"},
                                                        {"transverse_diameter", "m"},
                                                        {"inclination", "rad"},
                                                        {"tank_treading_angle", "rad"},
                                                        {"area", "m2"},
                                                        {"volume", "m3"}};
  const auto found = units.find(name);
  return found == units.end() ? "1" : found->second;
}

/// A dataset of fixed place: where it is, its unit, the numbers per row and where its values live.
template <class Owner>
struct Column {
  const char *name, *units;
  std::size_t width;
  std::vector<double> Owner::*values;
};
constexpr Column<Diagnostics> diagnostics_columns[] = {
    {"momentum_residual", "1", 3, &Diagnostics::momentum_residual},
    {"energy_residual", "1", 1, &Diagnostics::energy_residual},
    {"mass_error", "1", 1, &Diagnostics::mass_error},
    {"volume_error_max", "1", 1, &Diagnostics::volume_error_max},
    {"max_speed_ratio", "1", 1, &Diagnostics::max_speed_ratio},
    {"overlap_max", "m", 1, &Diagnostics::overlap_max},
    {"slip_rms", "m/s", 1, &Diagnostics::slip_rms},
    {"power_in", "W", 1, &Diagnostics::power_in},
    {"power_viscous", "W", 1, &Diagnostics::power_viscous},
    {"power_damping", "W", 1, &Diagnostics::power_damping},
    {"power_slip", "W", 1, &Diagnostics::power_slip},
    {"power_stressless", "W", 1, &Diagnostics::power_stressless},
    {"power_membranes", "W", 1, &Diagnostics::power_membranes},
    {"power_contact", "W", 1, &Diagnostics::power_contact},
    {"power_inertia", "W", 1, &Diagnostics::power_inertia}};
constexpr Column<Profiles> profile_columns[] = {{"velocity", "m/s", 3, &Profiles::velocity},
                                                {"hematocrit", "1", 1, &Profiles::hematocrit},
                                                {"shear_stress", "Pa", 1, &Profiles::shear_stress}};

/// Kinds become groups beside /profile and /diagnostics.
bool is_reserved(const std::string& name) { return name == "profile" || name == "diagnostics"; }

[[noreturn]] void inconsistent(const std::string& file, const std::string& dataset,
                               const std::string& problem) {
  throw InputError(file + ":" + dataset + ": " + problem);
}

std::string shape_text(const hdf5::Shape& shape) {
  std::string text;
  for (const std::size_t n : shape) text += (text.empty() ? "" : " x ") + std::to_string(n);
  return shape.empty() ? "scalar" : text;
}

// Checks, the same before writing and after reading
// ------------------------------------------------------------------

void check_increasing(const std::vector<double>& x, const std::string& file, const std::string& dataset) {
  for (std::size_t i = 0; i < x.size(); ++i) {
    if (!std::isfinite(x[i]))
      inconsistent(
          file, dataset,
          "value " + std::to_string(i) + " is not finite (a time or height is a number) repair the data");
    if (i > 0 && x[i] <= x[i - 1])
      inconsistent(file, dataset,
                   "value " + std::to_string(i) + " is " + format_number(x[i]) + " after " +
                       format_number(x[i - 1]) +
                       " (it must strictly increase) sort the samples and drop repeated ones");
  }
}

void check_finite(const std::vector<double>& x, std::size_t cells, const std::string& file,
                  const std::string& dataset) {
  for (std::size_t i = 0; i < x.size(); ++i)
    if (!std::isfinite(x[i]))
      inconsistent(file, dataset,
                   "not finite at time " + std::to_string(i / (3 * cells)) + ", cell " +
                       std::to_string(i / 3 % cells) +
                       " (counted from 0; a lost or blown-up cell) look at the run that wrote it");
}

void check_tracks(const Tracks& tracks, std::size_t times, const std::string& file,
                  const std::string& group) {
  const auto require_size = [&](const std::string& name, std::size_t have, std::size_t want) {
    if (have != want)
      inconsistent(file, group + "/" + name,
                   std::to_string(have) + " values (" + std::to_string(times) + " times and " +
                       std::to_string(tracks.cells()) + " cells make " + std::to_string(want) +
                       ") repair the data");
  };
  require_size("position", tracks.position.size(), times * tracks.cells() * 3);
  if (!tracks.orientation.empty())
    require_size("orientation", tracks.orientation.size(), times * tracks.cells() * 3);
  for (const auto& [name, values] : tracks.observables)
    if (!values.empty()) require_size(name, values.size(), times * tracks.cells());
  if (std::set<std::int64_t>(tracks.id.begin(), tracks.id.end()).size() != tracks.id.size())
    inconsistent(file, group + "/id", "an id appears twice (each cell has its own) repair the data");
  check_finite(tracks.position, tracks.cells(), file, group + "/position");
}

void check(const Trajectories& t, const std::string& file) {
  if (t.time.empty())
    inconsistent(file, "/time",
                 "no samples (there is nothing to analyse) let the run reach its first sample");
  check_increasing(t.time, file, "/time");
  std::size_t cells = 0;
  for (const auto& [name, tracks] : t.kinds) {
    if (name.empty() || is_reserved(name) || name.find('/') != std::string::npos)
      inconsistent(file, "/" + name, "no name for a kind of cell (it names a group) choose another");
    check_tracks(tracks, t.time.size(), file, "/" + name);
    cells += tracks.cells();
  }
  if (cells == 0) inconsistent(file, "/", "no cells (at least one track is needed) is it the right file?");
  for (int d = 0; d < 3; ++d)
    if (!std::isfinite(t.box[d]) || t.box[d] < 0)
      inconsistent(file, "box", "not a size (three lengths in m are expected) repair the attribute");
  if (!(t.walls_y[0] <= t.walls_y[1]))
    inconsistent(file, "walls_y",
                 "the lower wall is above the upper one (y of both, in m) repair the attribute");
  check_increasing(t.profile.time, file, "/profile/time");
  check_increasing(t.profile.y, file, "/profile/y");
  for (const auto& c : profile_columns)
    if (const auto n = (t.profile.*c.values).size();
        n && n != t.profile.time.size() * t.profile.y.size() * c.width)
      inconsistent(file, std::string("/profile/") + c.name,
                   std::to_string(n) + " values for " + std::to_string(t.profile.time.size()) +
                       " times and " + std::to_string(t.profile.y.size()) + " heights repair the data");
  check_increasing(t.diagnostics.time, file, "/diagnostics/time");
  for (const auto& c : diagnostics_columns)
    if (const auto n = (t.diagnostics.*c.values).size(); n && n != t.diagnostics.time.size() * c.width)
      inconsistent(file, std::string("/diagnostics/") + c.name,
                   std::to_string(n) + " values for " + std::to_string(t.diagnostics.time.size()) +
                       " times repair the data");
}

// Writing
// ---------------------------------------------------------------------------------------------------------------

void write_attributes(hdf5::File& file, const Trajectories& t) {
  file.write_attribute("format", std::string(format_name));
  file.write_attribute("version", t.version.empty() ? version() : t.version);
  file.write_attribute("acceleration", t.acceleration);
  file.write_attribute("shear_rate", t.shear_rate);
  file.write_attribute("box", std::vector<double>(t.box.begin(), t.box.end()));
  file.write_attribute("walls_y", std::vector<double>(t.walls_y.begin(), t.walls_y.end()));
  file.write_attribute("hematocrit_true", t.hematocrit_true);
  file.write_attribute("kappa_damping", t.kappa_damping);
  file.write_attribute("t_c", t.t_c);
  file.write_attribute("Ca", t.Ca);
  file.write_attribute("Re", t.Re);
  file.write_attribute("seed", t.seed);
  file.write_attribute("scene_yaml", t.scene_yaml);
  file.write_attribute("input_sha256", t.input_sha256);
}

void write_tracks(hdf5::File& file, const std::string& group, const Tracks& tracks, std::size_t T) {
  const std::size_t N = tracks.cells();
  file.write(group + "/id", {N}, tracks.id, "1");
  file.write(group + "/position", {T, N, 3}, tracks.position, "m");
  if (!tracks.orientation.empty()) file.write(group + "/orientation", {T, N, 3}, tracks.orientation, "1");
  for (const auto& [name, values] : tracks.observables)
    if (!values.empty()) file.write(group + "/" + name, {T, N}, values, observable_units(name));
}

void write_profile(hdf5::File& file, const Profiles& p) {
  const std::size_t P = p.time.size(), Y = p.y.size();
  if (Y == 0) return;
  file.write("/profile/time", {P}, p.time, "s");
  file.write("/profile/y", {Y}, p.y, "m");
  for (const auto& c : profile_columns)
    if (!(p.*c.values).empty() || P == 0)
      file.write(std::string("/profile/") + c.name,
                 c.width > 1 ? hdf5::Shape{P, Y, c.width} : hdf5::Shape{P, Y}, p.*c.values, c.units);
}

void write_diagnostics(hdf5::File& file, const Diagnostics& d) {
  const std::size_t K = d.time.size();
  if (K == 0) return;
  file.write("/diagnostics/time", {K}, d.time, "s");
  for (const auto& c : diagnostics_columns)
    if (!(d.*c.values).empty())
      file.write(std::string("/diagnostics/") + c.name,
                 c.width > 1 ? hdf5::Shape{K, c.width} : hdf5::Shape{K}, d.*c.values, c.units);
}

// Reading
// ---------------------------------------------------------------------------------------------------------------

/// Reads datasets with the shape and unit the format prescribes; other units of the same dimension are
/// converted.
class Reader {
 public:
  Reader(const std::string& path) : path_(path), file_(hdf5::File::open(path)) {}
  const hdf5::File& file() const { return file_; }

  std::vector<double> read(const std::string& dataset, const hdf5::Shape& shape,
                           const std::string& units) const {
    require_shape(dataset, shape);
    const double factor = conversion(dataset, units);
    auto values = file_.read(dataset);
    if (factor != 1)
      for (double& v : values) v *= factor;
    return values;
  }
  /// A vector of any length.
  std::vector<double> read_vector(const std::string& dataset, const std::string& units) const {
    if (const auto shape = file_.shape(dataset); shape.size() != 1)
      inconsistent(path_, dataset,
                   "its shape is " + shape_text(shape) + " (one dimension is expected) repair the data");
    return read(dataset, file_.shape(dataset), units);
  }
  void require_shape(const std::string& dataset, const hdf5::Shape& shape) const {
    const auto found = file_.shape(dataset);
    if (found != shape)
      inconsistent(
          path_, dataset,
          "its shape is " + shape_text(found) + " (" + shape_text(shape) + " is expected) repair the data");
  }
  double number(const std::string& attribute) const {
    if (!file_.has_attribute(attribute)) return unknown;
    const auto values = file_.attribute(attribute);
    if (values.size() != 1) inconsistent(path_, attribute, "the attribute is not one number repair the file");
    return values[0];
  }
  template <std::size_t n>
  std::array<double, n> numbers(const std::string& attribute) const {
    const auto values = file_.attribute(attribute);
    if (values.size() != n)
      inconsistent(path_, attribute,
                   "the attribute has " + std::to_string(values.size()) + " values (" + std::to_string(n) +
                       " are expected) repair the file");
    std::array<double, n> result;
    std::copy(values.begin(), values.end(), result.begin());
    return result;
  }
  std::string text(const std::string& attribute) const {
    return file_.has_attribute(attribute) ? file_.text_attribute(attribute) : "";
  }

 private:
  double conversion(const std::string& dataset, const std::string& units) const {
    try {
      return unit_factor(file_.units(dataset), units);
    } catch (const InputError& error) {
      const std::string what = error.what();
      if (what.rfind(path_, 0) == 0) throw;  // no units at all: named already
      inconsistent(path_, dataset, "units " + what);
    }
  }
  std::string path_;
  hdf5::File file_;
};

Trajectories read_attributes(const Reader& in, const std::string& path) {
  const std::string format = in.text("format");
  if (format != format_name)
    throw InputError(path + ": format `" + format.substr(0, 60) + "` (this reader expects " + format_name +
                     ") is it the right file or version?");
  Trajectories t;
  t.version = in.text("version");
  t.acceleration = in.number("acceleration");
  t.shear_rate = in.number("shear_rate");
  t.box = in.numbers<3>("box");
  t.walls_y = in.numbers<2>("walls_y");
  t.hematocrit_true = in.number("hematocrit_true");
  t.kappa_damping = in.number("kappa_damping");
  t.t_c = in.number("t_c");
  t.Ca = in.number("Ca");
  t.Re = in.number("Re");
  if (in.file().has_attribute("seed")) t.seed = in.file().integer_attribute("seed");
  t.scene_yaml = in.text("scene_yaml");
  t.input_sha256 = in.text("input_sha256");
  return t;
}

Tracks read_tracks(const Reader& in, const std::string& group, std::size_t T) {
  Tracks tracks;
  const auto ids = in.file().shape(group + "/id");
  in.require_shape(group + "/id", {ids.empty() ? 1 : ids[0]});
  tracks.id = in.file().read_integers(group + "/id");
  const std::size_t N = tracks.cells();
  tracks.position = in.read(group + "/position", {T, N, 3}, "m");
  for (const std::string& name : in.file().datasets(group)) {
    const std::string dataset = group + "/" + name;
    if (name == "orientation")
      tracks.orientation = in.read(dataset, {T, N, 3}, "1");
    else if (name != "id" && name != "position")
      tracks.observables[name] = in.read(dataset, {T, N}, observable_units(name));
  }
  return tracks;
}

template <class Owner, std::size_t n>
void read_columns(const Reader& in, const std::string& group, const hdf5::Shape& rows,
                  const Column<Owner> (&columns)[n], Owner& owner) {
  for (const auto& c : columns) {
    const std::string dataset = group + "/" + c.name;
    if (!in.file().has(dataset)) continue;
    hdf5::Shape shape = rows;
    if (c.width > 1) shape.push_back(c.width);
    owner.*c.values = in.read(dataset, shape, c.units);
  }
}

}  // namespace

void write_trajectories(const Trajectories& data, const std::string& path) {
  check(data, path);
  AtomicFile target(path);
  auto file = hdf5::File::create(target.temporary());
  write_attributes(file, data);
  file.write("/time", {data.time.size()}, data.time, "s");
  for (const auto& [name, tracks] : data.kinds) write_tracks(file, "/" + name, tracks, data.time.size());
  write_profile(file, data.profile);
  write_diagnostics(file, data.diagnostics);
  file.close();
  target.commit();
}

Trajectories read_trajectories(const std::string& path) {
  const Reader in(path);
  Trajectories t = read_attributes(in, path);
  t.time = in.read_vector("/time", "s");
  for (const std::string& name : in.file().groups("/"))
    if (!is_reserved(name)) t.kinds[name] = read_tracks(in, "/" + name, t.time.size());
  if (in.file().has("/profile/y")) {
    t.profile.time = in.read_vector("/profile/time", "s");
    t.profile.y = in.read_vector("/profile/y", "m");
    read_columns(in, "/profile", {t.profile.time.size(), t.profile.y.size()}, profile_columns, t.profile);
  }
  if (in.file().has("/diagnostics/time")) {
    t.diagnostics.time = in.read_vector("/diagnostics/time", "s");
    read_columns(in, "/diagnostics", {t.diagnostics.time.size()}, diagnostics_columns, t.diagnostics);
  }
  check(t, path);
  return t;
}

}  // namespace hemowalk::data
