#pragma once
/// \file Digitised reference data under shared/data beside the repository; tests skip where it is absent.

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

namespace hemowalk::test {

/// Folder of the reference data, empty where there is none.
inline std::string reference_folder(const std::string& name) {
  namespace fs = std::filesystem;
  for (fs::path at = HEMOWALK_SOURCE_DIR; at.has_relative_path(); at = at.parent_path()) {
    const auto folder = at / "shared" / "data" / name;
    if (fs::exists(folder)) return folder.string();
  }
  return {};
}

/// Rows of numbers, lines that do not start with one left out.
inline std::vector<std::vector<double>> read_numbers(const std::string& file) {
  std::vector<std::vector<double>> rows;
  std::ifstream in(file);
  for (std::string line; std::getline(in, line);) {
    std::replace(line.begin(), line.end(), ',', ' ');
    std::istringstream words(line);
    std::vector<double> row;
    for (double x = 0; words >> x;) row.push_back(x);
    if (!row.empty()) rows.push_back(row);
  }
  return rows;
}

/// A curve through points (x, y), linear between them; x sorted by the reader.
class Curve {
 public:
  explicit Curve(const std::string& file) {
    for (const auto& row : read_numbers(file)) points_.emplace_back(row.at(0), row.at(1));
    std::sort(points_.begin(), points_.end());
  }
  bool covers(double x) const { return points_.front().first <= x && x <= points_.back().first; }
  double first() const { return points_.front().first; }
  double last() const { return points_.back().first; }
  double operator()(double x) const {
    auto high = std::upper_bound(points_.begin(), points_.end(), std::pair{x, 1e300});
    if (high == points_.begin()) ++high;
    if (high == points_.end()) --high;
    const auto& [x1, y1] = *high;
    const auto& [x0, y0] = *(high - 1);
    return x1 > x0 ? y0 + (y1 - y0) * (x - x0) / (x1 - x0) : y0;
  }

 private:
  std::vector<std::pair<double, double>> points_;
};

}  // namespace hemowalk::test
