#include "core/data/transport_law.hpp"

#include <cmath>
#include <utility>

#include "core/data/formats.hpp"
#include "core/io.hpp"
#include "core/units.hpp"

namespace hemowalk::data {
namespace {

using yaml::Node;
using yaml::Problems;
using yaml::Value;

yaml::Field build_format() {
  using namespace yaml;
  const Field any = number(), positive = number().above(0), not_negative = number().at_least(0),
              share = number().at_least(0).at_most(1);
  const Field pair = list_of(any, 2, 2), values = list_of(any), rows = list_of(list_of(any));
  return map_of({
      format_key("hemowalk.transport_law/1"),
      with_default(
          "conditions",
          map_of({with_default("shear_rate_1_per_s", any.or_null(), "null", "nominal shear rate"),
                  with_default("hematocrit", share.or_null(), "null", "true hematocrit"),
                  with_default("gap_m", not_negative.or_null(), "null", "distance of the walls"),
                  with_default("kappa_damping", not_negative.or_null(), "null", "of the red cells"),
                  with_default("t_c_s", not_negative.or_null(), "null", "shape-recovery time"),
                  with_default("Ca", not_negative.or_null(), "null", "capillary number by G_s"),
                  with_default("Re", not_negative.or_null(), "null", "Reynolds number of a red cell")}),
          "{}", "what was simulated or measured; null = not known"),
      required("core",
               map_of({required("D_m2_per_s", positive, "diffusivity across the flow in the core"),
                       with_default("D_sigma", not_negative.or_null(), "0", "its standard error"),
                       with_default("lag_s", not_negative.or_null(), "0", "lag at which it was read"),
                       with_default("y_range_m", pair, "[0, 0]", "the core")}),
               "the core value"),
      with_default(
          "profile",
          map_of(
              {with_default("y_m", values, "[]", "heights, increasing; empty = the same D everywhere"),
               with_default("D_m2_per_s", list_of(not_negative), "[]", "D at y_m"),
               with_default("v_m_per_s", values, "[]", "drift at y_m without D': J = v c - D c'"),
               optional("draws",
                        map_of({with_default("D_m2_per_s", rows, "[]", "one row per draw, as long as y_m"),
                                with_default("v_m_per_s", rows, "[]", "one row per draw, as long as y_m")}),
                        "posterior draws")}),
          "{}", "D(y) and v(y)"),
      with_default("memory_s", not_negative.or_null(), "0", "velocity memory time"),
      with_default(
          "step_law",
          any_of({choice({"gaussian", "persistent", "heavy_tail"}),
                  tagged({required("persistent",
                                   map_of({required("memory_s", not_negative, "memory of the velocity")}),
                                   "Ornstein-Uhlenbeck velocity"),
                          required("heavy_tail",
                                   map_of({required("exponent", positive, "of the tail"),
                                           required("fraction", share, "of steps in the tail")}),
                                   "power-law tail")})}),
          "gaussian", "how a walker steps; persistent alone takes memory_s"),
      with_default("cell_free_layer_m", not_negative.or_null(), "null", "thickness"),
      with_default("scaling",
                   map_of({with_default("shear_exponent", any, "1", "D ~ shear rate ^ exponent"),
                           with_default("sigma", not_negative.or_null(), "null", "its standard error")}),
                   "{}", "with the local shear rate"),
      with_default("valid",
                   map_of({with_default("shear_rate_1_per_s", pair, "[0, 1e9]", "range of shear rates"),
                           with_default("hematocrit", pair, "[0, 1]", "range of hematocrits"),
                           with_default("dt_min_s", not_negative, "0", "shortest time step of a walk")}),
                   "{}", "where the law may be used"),
      with_default(
          "gate",
          map_of({with_default("passed", boolean(), "true", "no artefact found"),
                  with_default("findings",
                               list_of(map_of({required("name", text(), "what was tested"),
                                               with_default("value", any.or_null(), "null", "measured"),
                                               with_default("limit", any.or_null(), "null", "allowed"),
                                               with_default("passed", boolean(), "true", "within the limit"),
                                               optional("note", text(), "in words")})),
                               "[]", "the tests")}),
          "{}", "artefact gate of the trajectories"),
      with_default(
          "provenance",
          map_of({with_default("inputs_sha256", list_of(text()), "[]", "of the trajectories' scenes"),
                  with_default("version", any_of({text()}), "unknown", "of the program that wrote the law"),
                  with_default("seed", integer().at_least(0), "0", "of the bootstrap")}),
          "{}", "where the law comes from"),
  });
}

void check_increasing_pair(const Value& law, const std::string& path, Problems& problems) {
  if (const Value* pair = law.find(path); pair && pair->items[0].number() > pair->items[1].number())
    problems.add(pair->mark,
                 path + ": the first value is above the second (a range goes from low to high) swap them");
}

void check_law(const Value& law, Problems& problems) {
  for (const char* path : {"core.y_range_m", "valid.shear_rate_1_per_s", "valid.hematocrit"})
    check_increasing_pair(law, path, problems);
  const Value* y = law.find("profile.y_m");
  if (!y) return;
  const std::size_t n = y->items.size();
  for (std::size_t i = 1; i < n; ++i)
    if (y->items[i].number() <= y->items[i - 1].number()) {
      problems.add(y->items[i].mark,
                   "profile.y_m." + std::to_string(i) +
                       ": not above the height before it (heights increase) sort the profile");
      break;
    }
  const auto same_length = [&](const std::string& path, const Value& row) {
    if (row.items.size() != n)
      problems.add(row.mark, path + ": " + std::to_string(row.items.size()) + " values for " +
                                 std::to_string(n) + " heights (one per y_m) complete the profile");
  };
  for (const char* key : {"profile.D_m2_per_s", "profile.v_m_per_s"})
    if (const Value* row = law.find(key)) same_length(key, *row);
  const Value *D = law.find("profile.draws.D_m2_per_s"), *v = law.find("profile.draws.v_m_per_s");
  if (!D || !v) return;
  if (D->items.size() != v->items.size())
    problems.add(v->mark, "profile.draws: " + std::to_string(D->items.size()) + " draws of D and " +
                              std::to_string(v->items.size()) +
                              " of v (they are drawn together) complete them");
  for (const Value* rows : {D, v})
    for (std::size_t i = 0; i < rows->items.size(); ++i)
      same_length("profile.draws." + std::to_string(i), rows->items[i]);
}

std::array<double, 2> pair(const Value& v) { return {v["0"].number(), v["1"].number()}; }

std::vector<std::vector<double>> rows(const Value* v) {
  std::vector<std::vector<double>> result;
  if (v)
    for (const Value& row : v->items) result.push_back(row.numbers());
  return result;
}

TransportLaw::StepLaw step_law_of(const Value& v, double memory) {
  if (v.type == Value::Type::text) return {v.text(), v.text() == "persistent" ? memory : 0, 0, 0};
  if (const Value* p = v.find("persistent")) return {"persistent", (*p)["memory_s"].number(), 0, 0};
  return {"heavy_tail", 0, v["heavy_tail.exponent"].number(), v["heavy_tail.fraction"].number()};
}

TransportLaw law_of(const Value& v) {
  TransportLaw law;
  law.conditions = {v["conditions.shear_rate_1_per_s"].number(),
                    v["conditions.hematocrit"].number(),
                    v["conditions.gap_m"].number(),
                    v["conditions.kappa_damping"].number(),
                    v["conditions.t_c_s"].number(),
                    v["conditions.Ca"].number(),
                    v["conditions.Re"].number()};
  law.core = {v["core.D_m2_per_s"].number(), v["core.D_sigma"].number(), v["core.lag_s"].number(),
              pair(v["core.y_range_m"])};
  law.profile = {v["profile.y_m"].numbers(), v["profile.D_m2_per_s"].numbers(),
                 v["profile.v_m_per_s"].numbers(), rows(v.find("profile.draws.D_m2_per_s")),
                 rows(v.find("profile.draws.v_m_per_s"))};
  law.memory = v["memory_s"].number();
  law.step_law = step_law_of(v["step_law"], law.memory);
  law.cell_free_layer = v["cell_free_layer_m"].number();
  law.scaling = {v["scaling.shear_exponent"].number(), v["scaling.sigma"].number()};
  law.valid = {pair(v["valid.shear_rate_1_per_s"]), pair(v["valid.hematocrit"]),
               v["valid.dt_min_s"].number()};
  law.gate.passed = v["gate.passed"].boolean();
  for (const Value& f : v["gate.findings"].items)
    law.gate.findings.push_back({f["name"].text(), f["value"].number(), f["limit"].number(),
                                 f["passed"].boolean(), f.has("note") ? f["note"].text() : ""});
  for (const Value& hash : v["provenance.inputs_sha256"].items)
    law.provenance.inputs_sha256.push_back(hash.text());
  law.provenance.version = v["provenance.version"].text();
  law.provenance.seed = static_cast<std::uint64_t>(v["provenance.seed"].integer());
  return law;
}

// Writing
// -------------------------------------------------------------------------------------------------------------

/// All 17 digits that matter; NaN, which means not known, as null.
Node value(double x) {
  if (std::isnan(x)) return {};
  return yaml::scalar(format_number(x));
}
Node truth(bool x) { return yaml::scalar(x ? "true" : "false"); }
Node values(const std::vector<double>& x) {
  std::vector<Node> items;
  items.reserve(x.size());
  for (const double v : x) items.push_back(value(v));
  return yaml::list(std::move(items));
}
Node pair(const std::array<double, 2>& x) { return yaml::list({value(x[0]), value(x[1])}); }
Node rows(const std::vector<std::vector<double>>& x) {
  std::vector<Node> items;
  for (const auto& row : x) items.push_back(values(row));
  return yaml::list(std::move(items));
}

Node profile(const TransportLaw::Profile& p) {
  Node node = yaml::map({{"y_m", values(p.y)}, {"D_m2_per_s", values(p.D)}, {"v_m_per_s", values(p.v)}});
  if (!p.D_draws.empty() || !p.v_draws.empty())
    node.set("draws", yaml::map({{"D_m2_per_s", rows(p.D_draws)}, {"v_m_per_s", rows(p.v_draws)}}));
  return node;
}

Node step_law(const TransportLaw::StepLaw& s) {
  if (s.kind == "persistent") return yaml::map({{"persistent", yaml::map({{"memory_s", value(s.memory)}})}});
  if (s.kind == "heavy_tail")
    return yaml::map({{"heavy_tail", yaml::map({{"exponent", value(s.tail_exponent)},
                                                {"fraction", value(s.tail_fraction)}})}});
  return yaml::scalar(s.kind);
}

Node gate(const TransportLaw::Gate& g) {
  std::vector<Node> findings;
  for (const Finding& f : g.findings) {
    Node one = yaml::map({{"name", yaml::scalar(f.name)},
                          {"value", value(f.value)},
                          {"limit", value(f.limit)},
                          {"passed", truth(f.passed)}});
    if (!f.note.empty()) one.set("note", yaml::scalar(f.note));
    findings.push_back(std::move(one));
  }
  return yaml::map({{"passed", truth(g.passed)}, {"findings", yaml::list(std::move(findings))}});
}

Node provenance(const TransportLaw::Provenance& p) {
  std::vector<Node> hashes;
  for (const std::string& h : p.inputs_sha256)
    if (!h.empty()) hashes.push_back(yaml::scalar(h));
  return yaml::map({{"inputs_sha256", yaml::list(std::move(hashes))},
                    {"version", yaml::scalar(p.version.empty() ? "unknown" : p.version)},
                    {"seed", yaml::scalar(std::to_string(p.seed))}});
}

Node law_node(const TransportLaw& law) {
  const auto& c = law.conditions;
  return yaml::map({
      {"format", yaml::scalar("hemowalk.transport_law/1")},
      {"conditions", yaml::map({{"shear_rate_1_per_s", value(c.shear_rate)},
                                {"hematocrit", value(c.hematocrit)},
                                {"gap_m", value(c.gap)},
                                {"kappa_damping", value(c.kappa_damping)},
                                {"t_c_s", value(c.t_c)},
                                {"Ca", value(c.Ca)},
                                {"Re", value(c.Re)}})},
      {"core", yaml::map({{"D_m2_per_s", value(law.core.D)},
                          {"D_sigma", value(law.core.D_sigma)},
                          {"lag_s", value(law.core.lag)},
                          {"y_range_m", pair(law.core.y_range)}})},
      {"profile", profile(law.profile)},
      {"memory_s", value(law.memory)},
      {"step_law", step_law(law.step_law)},
      {"cell_free_layer_m", value(law.cell_free_layer)},
      {"scaling", yaml::map({{"shear_exponent", value(law.scaling.shear_exponent)},
                             {"sigma", value(law.scaling.sigma)}})},
      {"valid", yaml::map({{"shear_rate_1_per_s", pair(law.valid.shear_rate)},
                           {"hematocrit", pair(law.valid.hematocrit)},
                           {"dt_min_s", value(law.valid.dt_min)}})},
      {"gate", gate(law.gate)},
      {"provenance", provenance(law.provenance)},
  });
}

Value checked(const Node& root, Problems& problems) {
  Value value = yaml::validate(root, transport_law_format(), problems);
  check_law(value, problems);
  problems.throw_if_any();
  return value;
}

}  // namespace

const yaml::Field& transport_law_format() {
  static const yaml::Field format = build_format();
  return format;
}

TransportLaw TransportLaw::constant(double D) {
  require(std::isfinite(D) && D > 0,
          "a constant D of " + format_number(D) + " m2/s (it must be positive) give a positive value");
  TransportLaw law;
  const double unknown = std::nan("");
  law.conditions = {unknown, unknown, unknown, unknown, unknown, unknown, unknown};
  law.core.D = D;
  law.cell_free_layer = unknown;
  law.scaling = {0, 0};  // a stated constant does not scale with anything
  return law;
}

TransportLaw parse_transport_law(const std::string& text, const std::string& name) {
  Problems problems;
  const Node root = yaml::parse(text, name, problems);
  return law_of(checked(root, problems));
}

TransportLaw read_transport_law(const std::string& path) {
  return parse_transport_law(read_input_file(path), path);
}

void write_transport_law(const TransportLaw& law, const std::string& path) {
  Problems problems;
  write_file_atomic(path, yaml::canonical_text(checked(law_node(law), problems)));
}

}  // namespace hemowalk::data
