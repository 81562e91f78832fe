/// \file Published trajectories of Kotsalos et al. 2020 (one text file per platelet) to the Trajectories
/// noun.
///
/// What the files do not say is stated here, once: the fluid step, the nominal shear rate and hematocrit, and
/// where the walls are (planes 1 um inside the box). The period along x and z is read off the data: the
/// positions fill [0, 49.5] um, i.e. 99 lattice intervals of 0.5 um, not the 50 um of the box.

#include <algorithm>
#include <charconv>
#include <cmath>
#include <filesystem>
#include <limits>
#include <sstream>

#include "calibration/calibration.hpp"
#include "core/check.hpp"
#include "core/io.hpp"
#include "core/provenance.hpp"

namespace hemowalk::calibration {
namespace {

namespace fs = std::filesystem;

constexpr double fluid_step = 0.125e-6;  // s
constexpr double um = 1e-6;
constexpr double box = 50 * um, lattice = 0.5 * um;
constexpr double wall_offset = 1 * um;
constexpr double nominal_shear_rate = 100, nominal_hematocrit = 0.35;

struct TextTrack {
  std::int64_t id = 0;
  std::vector<double> step;
  std::vector<std::array<double, 3>> position;  // um, wrapped
  std::string sha256;
};

/// The last run of digits in a file name: body_476_ComPos.log -> 476.
std::int64_t id_from_name(const std::string& name, std::int64_t fallback) {
  const auto end = name.find_last_of("0123456789");
  if (end == std::string::npos) return fallback;
  auto begin = end;
  while (begin > 0 && std::isdigit(static_cast<unsigned char>(name[begin - 1]))) --begin;
  return std::stoll(name.substr(begin, std::min<std::size_t>(end - begin + 1, 18)));
}

/// Four comma-separated numbers; false when the line is anything else.
bool parse_row(const std::string& line, std::array<double, 4>& row) {
  const char *at = line.data(), *end = line.data() + line.size();
  for (std::size_t k = 0; k < 4; ++k) {
    while (at < end && (*at == ' ' || *at == '\t')) ++at;
    const auto [next, error] = std::from_chars(at, end, row[k]);
    if (error != std::errc()) return false;
    at = next;
    while (at < end && (*at == ' ' || *at == '\t' || *at == '\r')) ++at;
    if (k < 3 && (at == end || *at++ != ',')) return false;
  }
  return at == end;
}

TextTrack read_track(const fs::path& file, std::int64_t fallback_id) {
  const std::string content = read_file(file.string());
  std::istringstream in(content);
  TextTrack track;
  track.sha256 = sha256(content);
  track.id = id_from_name(file.filename().string(), fallback_id);
  std::string line;
  for (int number = 1; std::getline(in, line); ++number) {
    if (line.find_first_not_of(" \t\r") == std::string::npos) continue;
    std::array<double, 4> row{};
    require(parse_row(line, row), [&] {
      return file.string() + ":" + std::to_string(number) +
             ": not a row of the form 'step, x, y, z' (found '" + line.substr(0, 40) +
             "') remove or repair the line";
    });
    const bool finite = std::all_of(row.begin(), row.end(), [](double v) { return std::isfinite(v); });
    require(finite, [&] {
      return file.string() + ":" + std::to_string(number) +
             ": a value is not a number (blow-up or damaged file?) remove the rows from here on in every "
             "file";
    });
    require(track.step.empty() || row[0] > track.step.back(), [&] {
      return file.string() + ":" + std::to_string(number) +
             ": steps are not increasing (unsorted file?) sort the rows";
    });
    track.step.push_back(row[0]);
    track.position.push_back({row[1], row[2], row[3]});
  }
  return track;
}

/// Period of a wrapped axis, um: the extent that the positions fill, to the nearest lattice spacing. With n
/// values spread over a period L the extent falls short by about 2 L/n, far below half a spacing for real
/// data.
double period_of(const std::vector<TextTrack>& tracks, std::size_t axis) {
  double low = std::numeric_limits<double>::max(), high = -low;
  for (const auto& t : tracks)
    for (const auto& p : t.position) {
      low = std::min(low, p[axis]);
      high = std::max(high, p[axis]);
    }
  return std::round((high - low) * um / lattice) * lattice / um;
}

/// True when some step is so long that only a wrap explains it.
bool is_wrapped(const std::vector<TextTrack>& tracks, std::size_t axis) {
  for (const auto& t : tracks)
    for (std::size_t i = 1; i < t.position.size(); ++i)
      if (std::abs(t.position[i][axis] - t.position[i - 1][axis]) > box / um / 2) return true;
  return false;
}

std::vector<TextTrack> read_all(const std::string& folder) {
  require(fs::is_directory(folder),
          "no folder " + folder + " (nothing to import) give the folder of the text files");
  std::vector<fs::path> files;
  for (const auto& entry : fs::directory_iterator(folder)) {
    const std::string extension = entry.path().extension();
    if (entry.is_regular_file() && (extension == ".log" || extension == ".csv" || extension == ".txt"))
      files.push_back(entry.path());
  }
  require(!files.empty(), "no .log, .csv or .txt file in " + folder +
                              " (expected one file 'step, x, y, z' per platelet) check the path");
  std::sort(files.begin(), files.end());
  std::vector<TextTrack> tracks;
  for (std::size_t k = 0; k < files.size(); ++k) {
    tracks.push_back(read_track(files[k], static_cast<std::int64_t>(k)));
    const auto& t = tracks.back();
    require(!t.step.empty(),
            files[k].string() + " is empty (no trajectory) remove the file or fetch it again");
    require(t.step == tracks.front().step,
            files[k].string() + " has other time steps than " + files[0].string() +
                " (platelets of one run share their samples) import them apart");
  }
  return tracks;
}

}  // namespace

data::Trajectories import_text_folder(const std::string& folder) {
  const std::vector<TextTrack> source = read_all(folder);
  const std::size_t samples = source.front().step.size(), cells = source.size();
  const double nan = std::numeric_limits<double>::quiet_NaN();

  data::Trajectories out;
  out.version = "import";
  out.shear_rate = nominal_shear_rate;
  out.hematocrit_true = nominal_hematocrit;
  out.kappa_damping = out.t_c = out.Ca = out.Re = nan;
  out.walls_y = {wall_offset, box - wall_offset};
  out.box = {box, box, box};
  for (double s : source.front().step) out.time.push_back(s * fluid_step);

  data::Tracks tracks;
  tracks.position.resize(samples * cells * 3);
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const bool wrapped = axis != 1 && is_wrapped(source, axis);
    const double period = wrapped ? period_of(source, axis) : 0;
    if (wrapped) out.box[axis] = period * um;
    for (std::size_t n = 0; n < cells; ++n) {
      double shift = 0;
      for (std::size_t t = 0; t < samples; ++t) {
        const double here = source[n].position[t][axis];
        if (wrapped && t) shift -= period * std::round((here - source[n].position[t - 1][axis]) / period);
        tracks.position[(t * cells + n) * 3 + axis] = (here + shift) * um;
      }
    }
  }
  std::string hashes;
  for (const auto& t : source) {
    tracks.id.push_back(t.id);
    hashes += t.sha256;
  }
  out.input_sha256 = sha256(hashes);
  out.kinds["platelet"] = std::move(tracks);
  return out;
}

}  // namespace hemowalk::calibration
