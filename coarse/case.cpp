#include "coarse/case.hpp"

#include <cctype>
#include <cmath>
#include <filesystem>
#include <utility>

#include "core/data/formats.hpp"
#include "core/io.hpp"
#include "core/provenance.hpp"
#include "core/units.hpp"
#include "core/yaml/schema.hpp"

namespace hemowalk::coarse {
namespace {

using yaml::Node;
using yaml::Problems;
using yaml::Value;

yaml::Field face() {
  using namespace yaml;
  const Field residence = quantity("s", "s").above(0);
  return any_of(
      {choice({"reflect", "absorb", "periodic"}),
       tagged(
           {required("robin", quantity("m/s", "mm/s").above(0), "reaction rate k"),
            required("trap",
                     any_of({map_of({required("residence", residence, "mean time in the layer"),
                                     with_default("layer", quantity("m", "um").at_least(0), "0 um",
                                                  "thickness of the layer; 0 = the law's cell-free layer")}),
                             residence}),
                     "mean residence time in the layer at the wall")})});
}

yaml::Field build_format() {
  using namespace yaml;
  const Field duration = quantity("s", "s");
  return map_of({
      format_key("hemowalk.coarse/1"),
      optional("name", text(), "names the output; the file's own name by default").not_physical(),
      optional(
          "law",
          any_of({tagged({required("D", quantity("m2/s", "um2/s").above(0), "one diffusivity everywhere")}),
                  text()}),
          "file with a transport law; in a campaign: by default the campaign's own"),
      with_default("domain",
                   map_of({with_default("height", quantity("m", "mm").above(0), "0.82 mm", "of the slab"),
                           with_default("bottom", face(), "absorb", "the face at y = 0"),
                           with_default("top", face(), "reflect", "the face at y = height")}),
                   "{}", "the slab"),
      with_default(
          "flow",
          any_of({choice({"rest"}), tagged({required("couette", quantity("1/s", "1/s"), "shear rate")})}),
          "rest", "advection along z"),
      with_default("walkers", integer().at_least(1).at_most(1e11), "1e6", "number of walkers"),
      with_default("dt", duration.above(0), "10 ms", "time step"),
      with_default("end", duration.above(0), "300 s", "physical time"),
      with_default("output", list_of(duration.at_least(0)), "[]",
                   "times of output, increasing; the end by default"),
      with_default("initial",
                   any_of({choice({"uniform"}),
                           tagged({required("layer", list_of(quantity("m", "um").at_least(0), 2, 2),
                                            "lower and upper height of the layer that is filled evenly")})}),
                   "uniform", "where the walkers start"),
      with_default("seed", integer().at_least(0), "1", "of all random numbers"),
      with_default("place", choice({"host", "device"}), "host",
                   "where the walkers are: device = an NVIDIA GPU"),
  });
}

bool is_file_stem(const std::string& name) {
  for (const char c : name)
    if (!std::isalnum(static_cast<unsigned char>(c)) && c != '_' && c != '-' && c != '.') return false;
  return !name.empty() && name[0] != '.' && name.size() <= 100;
}

void check_case(const Value& v, Problems& problems) {
  const Value *end = v.find("end"), *dt = v.find("dt"), *output = v.find("output");
  if (end && dt && dt->number() > end->number())
    problems.add(dt->mark, "dt: " + format_number(dt->number()) + " s is above end = " +
                               format_number(end->number()) + " s (not one step fits) shorten dt");
  for (std::size_t i = 0; output && i < output->items.size(); ++i) {
    const double t = output->items[i].number();
    const std::string where = "output." + std::to_string(i) + ": " + format_number(t) + " s ";
    if (i > 0 && t <= output->items[i - 1].number())
      problems.add(output->items[i].mark,
                   where + "is not after the time before it (times increase) sort them");
    else if (end && t > end->number())
      problems.add(output->items[i].mark, where + "is after end = " + format_number(end->number()) +
                                              " s (the walk has stopped) drop it or raise end");
  }
  const auto periodic = [&](const char* path) {
    const Value* face = v.find(path);
    return face && face->type == Value::Type::text && face->word == "periodic";
  };
  if (v.has("domain.top") && v.has("domain.bottom") && periodic("domain.top") != periodic("domain.bottom"))
    problems.add(v["domain"].mark,
                 "domain: one face periodic, the other not (a period joins both) make both periodic");
  if (const Value* low = v.find("initial.layer.0"), *high = v.find("initial.layer.1"),
      *height = v.find("domain.height");
      low && high && height && !(low->number() < high->number() && high->number() <= height->number()))
    problems.add(low->mark, "initial.layer: " + format_number(low->number()) + " .. " +
                                format_number(high->number()) +
                                " m is no layer of the slab (0 <= lower < upper <= height = " +
                                format_number(height->number()) + " m) correct it");
  if (const Value* name = v.find("name"); name && !is_file_stem(name->text()))
    problems.add(name->mark, "name: `" + name->text().substr(0, 60) +
                                 "` names a file (letters, digits, _, - and .) choose another");
}

Face face_of(const Value& v) {
  if (v.type == Value::Type::text)
    return {v.word == "absorb"     ? Face::Type::absorb
            : v.word == "periodic" ? Face::Type::periodic
                                   : Face::Type::reflect,
            0, 0};
  if (const Value* robin = v.find("robin")) return {Face::Type::robin, robin->number(), 0};
  const Value& trap = v["trap"];
  if (trap.type == Value::Type::number) return {Face::Type::trap, trap.number(), 0};
  return {Face::Type::trap, trap["residence"].number(), trap["layer"].number()};
}

Case case_of(const Value& v, const std::string& name) {
  Case c;
  c.name = v.has("name") ? v["name"].text() : name;
  if (const Value* law = v.find("law")) {
    if (law->type == Value::Type::text)
      c.law_file = law->text();
    else
      c.constant_D = (*law)["D"].number();
  }
  c.height = v["domain.height"].number();
  c.bottom = face_of(v["domain.bottom"]);
  c.top = face_of(v["domain.top"]);
  c.shear_rate = v.has("flow.couette") ? v["flow.couette"].number() : 0;
  c.walkers = v["walkers"].integer();
  c.dt = v["dt"].number();
  c.end = v["end"].number();
  c.output = v["output"].numbers();
  if (c.output.empty()) c.output = {c.end};
  if (v.has("initial.layer")) c.release = {v["initial.layer.0"].number(), v["initial.layer.1"].number()};
  c.seed = static_cast<std::uint64_t>(v["seed"].integer());
  c.place = v["place"].choice<Place>();
  return c;
}

}  // namespace

const yaml::Field& case_format() {
  static const yaml::Field format = build_format();
  return format;
}

std::optional<Case> case_from(const Node& root, const std::string& folder, const std::string& name,
                              bool law_required, Problems& problems) {
  Problems own;
  Value v = yaml::validate(root, case_format(), own);
  check_case(v, own);
  const auto law = v.members.find("law");
  const bool law_given = root.is_map() && root.find("law");
  if (law_required && v.type == Value::Type::map && !law_given)
    own.add(root.mark, "`law` is missing (walkers need a diffusivity) add law: FILE or law: {D: 1e-10 m2/s}");
  if (law != v.members.end() && law->second.type == Value::Type::text) {
    Value& file = law->second;
    file.word = data::resolved_path(folder, file.word);
    std::error_code error;
    if (!std::filesystem::is_regular_file(file.word, error))
      own.add(file.mark,
              "law: file `" + file.word +
                  "` does not exist (names are relative to the file that holds them) check the name");
  }
  problems.append(own);
  if (!own.empty()) return {};
  Case result = case_of(v, name);
  result.source_text = yaml::canonical_text(v);
  if (!result.law_file.empty()) law->second.word = "sha256:" + sha256_of_file(result.law_file);
  result.input_sha256 = sha256(yaml::physical_text(v));
  result.warnings = own.warnings();
  return result;
}

Case parse_case(const std::string& text, const std::string& name, const std::vector<std::string>& overrides) {
  Problems problems;
  Node root = yaml::parse(text, name, problems);
  yaml::apply_overrides(root, case_format(), overrides, problems);
  const std::string stem = std::filesystem::path(name).stem().string();
  auto result = case_from(root, data::folder_of(name), is_file_stem(stem) ? stem : "coarse", true, problems);
  problems.throw_if_any();
  return *result;
}

Case read_case(const std::string& path, const std::vector<std::string>& overrides) {
  return parse_case(read_input_file(path), path, overrides);
}

}  // namespace hemowalk::coarse
