#pragma once
/// \file Case: one coarse-grained transport problem (coarse.yaml), SI units.

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "core/portability.hpp"

namespace hemowalk::yaml {
struct Field;
struct Node;
class Problems;
}  // namespace hemowalk::yaml

namespace hemowalk::coarse {

/// What a face does to a walker that reaches it.
struct Face {
  enum class Type { reflect, absorb, robin, trap, periodic } type = Type::reflect;
  double rate = 0;   ///< robin: k, m/s; trap: residence time, s
  double layer = 0;  ///< trap: thickness of the trapping layer, m; 0 = the law's cell_free_layer
};

struct Case {
  std::string law_file;  ///< transport_law.yaml, resolved relative to the case file
  std::optional<double>
      constant_D;           ///< m2/s; exactly one of the two is set (neither in a campaign: its own law)
  double height = 0.82e-3;  ///< m
  Face bottom{Face::Type::absorb, 0}, top{Face::Type::reflect, 0};
  double shear_rate = 0;  ///< 1/s, couette advection along z; 0 = none
  std::int64_t walkers = 1'000'000;
  double dt = 10e-3;           ///< s
  double end = 300;            ///< s
  std::vector<double> output;  ///< s, increasing, <= end
  std::optional<std::array<double, 2>>
      release;  ///< m, the layer over which the walkers are spread evenly at the start; none = the whole slab
  std::uint64_t seed = 1;
  Place place = Place::host;          ///< of the walkers
  std::string name = "coarse";        ///< file stem, names the output
  std::string source_text;            ///< canonical YAML of this case
  std::string input_sha256;           ///< of what decides the results; a law file counts by its content
  std::vector<std::string> warnings;  ///< keys without effect, as file:line:col: problem (why) suggestion
};

/// Reads coarse.yaml. \throws InputError with every problem as file:line:col.
Case read_case(const std::string& path, const std::vector<std::string>& overrides = {});
Case parse_case(const std::string& text, const std::string& name,
                const std::vector<std::string>& overrides = {});

/// The format of coarse.yaml.
const yaml::Field& case_format();
/// The case in \p root, a document or a part of one; file names in it are relative to \p folder. Without a
/// `name:` key it is called \p name. Adds all problems to \p problems; no case if there is any.
std::optional<Case> case_from(const yaml::Node& root, const std::string& folder, const std::string& name,
                              bool law_required, yaml::Problems& problems);

}  // namespace hemowalk::coarse
