#include "workflow/campaign.hpp"

#include <algorithm>
#include <filesystem>
#include <set>

#include "core/data/formats.hpp"
#include "core/io.hpp"
#include "core/provenance.hpp"
#include "core/random.hpp"
#include "core/units.hpp"

namespace hemowalk::workflow {
namespace {

using yaml::Field;
using yaml::Mark;
using yaml::Node;
using yaml::Problems;
using yaml::Value;

constexpr std::size_t most_runs = 10000;

/// A document that sits in another file, or the node itself; where its file names start and what it is
/// called.
struct Inlined {
  std::string folder, stem;
};

/// Replaces a file name by the content of that file.
Inlined inline_file(Node& node, const std::string& folder, const std::string& stem, Problems& problems) {
  if (!node.is_scalar()) return {folder, stem};
  const std::string path = (std::filesystem::path(folder) / node.text).lexically_normal().string();
  std::error_code error;
  if (!std::filesystem::is_regular_file(path, error)) {
    problems.add(node.mark, "file `" + path +
                                "` does not exist (names are relative to the campaign file) check the name");
    node = {};
    return {folder, stem};
  }
  node = yaml::parse(read_file(path), path, problems);
  return {data::folder_of(path), std::filesystem::path(path).stem().string()};
}

void add_format(Node& node, const Field& format) {
  if (!node.is_map() || node.find("format")) return;
  Node word = yaml::scalar(format.keys.front().field.words.front());
  word.mark = node.mark;
  node.set("format", word);
}

std::vector<SweepKey> read_sweep(const Node* sweep, Problems& problems) {
  std::vector<SweepKey> keys;
  if (!sweep || sweep->type == Node::Type::null) return keys;
  if (!sweep->is_map()) {
    problems.add(
        sweep->mark,
        "sweep: not a map (dotted keys of the scene and their values) write it like {fluid.tau: [1, 2]}");
    return keys;
  }
  for (const yaml::Member& m : sweep->members) {
    if (!yaml::check_path(data::scene_format(), m.key, m.mark, problems)) continue;
    if (!m.value.is_list() || m.value.items.empty())
      problems.add(m.value.mark,
                   "sweep." + m.key + ": no list of values (each of them is simulated) write it like [1, 2]");
    else
      keys.push_back({m.key, m.value.items});
  }
  return keys;
}

/// Points of the sweep; beyond most_runs the number itself does not matter.
std::size_t points_of(const Campaign& c) {
  std::size_t n = c.zip && !c.sweep.empty() ? most_runs : 1;
  for (const SweepKey& k : c.sweep)
    n = c.zip ? std::min(n, k.values.size()) : std::min(n * k.values.size(), most_runs + 1);
  return n;
}

void check_sweep(const Campaign& c, const Node* sweep, Problems& problems) {
  if (c.zip)
    for (const SweepKey& k : c.sweep)
      if (k.values.size() != c.sweep.front().values.size())
        problems.add(k.values.front().mark, "sweep." + k.key + ": " + std::to_string(k.values.size()) +
                                                " values, " + c.sweep.front().key + " has " +
                                                std::to_string(c.sweep.front().values.size()) +
                                                " (zip: true takes them together) give equally many");
  if (points_of(c) * static_cast<std::size_t>(c.replicas) > most_runs)
    problems.add(sweep ? sweep->mark : c.scene.mark, "more than " + std::to_string(most_runs) +
                                                         " runs (points times replicas) thin out the sweep");
}

/// What a folder or file holds, as one hash.
std::string content_hash(const std::string& path) {
  std::error_code error;
  if (!std::filesystem::is_directory(path, error)) return sha256_of_file(path);
  std::set<std::string> files;
  for (const auto& entry : std::filesystem::directory_iterator(path, error))
    if (entry.is_regular_file()) files.insert(entry.path().string());
  std::string text;
  for (const std::string& file : files)
    text += std::filesystem::path(file).filename().string() + " " + sha256_of_file(file) + "\n";
  return sha256(text);
}

std::optional<TrajectorySource> read_source(Value& v, std::size_t number, const std::string& folder,
                                            Problems& problems) {
  TrajectorySource s;
  const std::string where = "trajectories." + std::to_string(number);
  const int kinds = v.has("synthetic") + v.has("import") + v.has("file");
  if (kinds != 1) {
    problems.add(v.mark, where + ": " + std::to_string(kinds) +
                             " of synthetic, import and file (each source is one of them) give one");
    return {};
  }
  s.optional = v.has("optional") && v["optional"].boolean();
  if (const Value* synthetic = v.find("synthetic")) {
    for (const char* key : {"platelets", "duration", "sample", "gap", "D", "D_contrast", "memory",
                            "jump_fraction", "jump_size", "shear_rate", "hematocrit", "seed"})
      if (!synthetic->has(key)) return {};
    const Value& g = *synthetic;
    auto& t = s.synthetic;
    t.platelets = static_cast<int>(g["platelets"].integer());
    t.duration = g["duration"].number();
    t.sample = g["sample"].number();
    t.gap = g["gap"].number();
    t.D = g["D"].number();
    t.D_contrast = g["D_contrast"].number();
    t.memory = g["memory"].number();
    t.jump_fraction = g["jump_fraction"].number();
    t.jump_size = g["jump_size"].number();
    t.shear_rate = g["shear_rate"].number();
    t.hematocrit = g["hematocrit"].number();
    t.seed = static_cast<std::uint64_t>(g["seed"].integer());
    if (t.sample > t.duration)
      problems.add(g["sample"].mark,
                   where + ".synthetic.sample: longer than the record (no interval fits) shorten it");
  } else {
    s.type = v.has("import") ? TrajectorySource::Type::import : TrajectorySource::Type::file;
    const std::string key = v.has("import") ? "import" : "file";
    s.path = data::resolved_path(folder, v[key].text());
    v.members[key].word = s.path;
    std::error_code error;
    s.present = key == "import" ? std::filesystem::is_directory(s.path, error)
                                : std::filesystem::is_regular_file(s.path, error);
    const std::string absent =
        where + "." + key + ": `" + s.path + "` does not exist (names are relative to the campaign file)";
    if (!s.present && s.optional) problems.warn(v[key].mark, absent + " skipped, it is optional");
    if (!s.present && !s.optional)
      problems.add(v[key].mark, absent + " check the name or say optional: true");
  }
  static const char* words[] = {"synthetic", "import", "file"};
  s.name = v.has("name")    ? v["name"].text()
           : s.path.empty() ? words[static_cast<int>(s.type)]
                            : std::filesystem::path(s.path).stem().string();
  s.text = yaml::canonical_text(v);
  Value hashed = v;
  for (const char* key : {"import", "file"})
    if (s.present && hashed.has(key)) hashed.members[key].word = "sha256:" + content_hash(s.path);
  s.hash = run_hash(sha256(yaml::physical_text(hashed)));
  return s;
}

/// Synthetic sources once per replica, with the replica's seed.
std::vector<TrajectorySource> replicated(const TrajectorySource& source, int replicas, std::size_t point) {
  std::vector<TrajectorySource> result;
  for (int r = 0; r < (source.type == TrajectorySource::Type::synthetic ? replicas : 1); ++r) {
    TrajectorySource one = source;
    one.point = point;
    one.replica = r;
    one.synthetic.seed = replica_seed(source.synthetic.seed, r);
    if (r > 0) one.hash = run_hash(source.hash + std::to_string(one.synthetic.seed));
    result.push_back(std::move(one));
  }
  return result;
}

calibration::Options calibration_of(const Value& v) {
  calibration::Options o;
  o.kind = v["kind"].text();
  o.t0 = v["t0"].number();
  if (v["lag"].type == Value::Type::number) o.lag = v["lag"].number();
  if (v["layer"].type == Value::Type::list) o.core = {{v["layer.0"].number(), v["layer.1"].number()}};
  o.bootstrap = static_cast<int>(v["bootstrap"].integer());
  o.seed = static_cast<std::uint64_t>(v["seed"].integer());
  return o;
}

std::vector<coarse::Case> read_cases(Node* list, const std::vector<Inlined>& origins, Problems& problems) {
  std::vector<coarse::Case> cases;
  if (!list || !list->is_list()) return cases;
  std::set<std::string> names;
  for (std::size_t i = 0; i < list->items.size(); ++i) {
    Node& node = list->items[i];
    if (node.type == Node::Type::null) continue;  // its file is missing: reported
    add_format(node, coarse::case_format());
    auto one = coarse::case_from(node, origins[i].folder, origins[i].stem, false, problems);
    if (!one) continue;
    if (!names.insert(one->name).second)
      problems.add(node.mark, "coarse." + std::to_string(i) + ": a second case called `" + one->name +
                                  "` (the name is that of its output file) give it another `name:`");
    cases.push_back(std::move(*one));
  }
  return cases;
}

/// The scenes of all points and replicas.
std::vector<Run> expand(const Campaign& c, Problems& problems) {
  std::vector<Run> runs;
  if (c.scene.type == Node::Type::null) return runs;
  const std::size_t points = points_of(c);
  for (std::size_t p = 0; p < points; ++p) {
    Run run;
    run.point = p;
    Node root = c.scene;
    std::size_t rest = p;
    std::vector<std::size_t> choice(c.sweep.size(), p);
    if (!c.zip)
      for (std::size_t k = c.sweep.size(); k-- > 0;) {
        choice[k] = rest % c.sweep[k].values.size();
        rest /= c.sweep[k].values.size();
      }
    for (std::size_t k = 0; k < c.sweep.size(); ++k) {
      const Node& value = c.sweep[k].values[choice[k]];
      yaml::set_path(root, data::scene_format(), c.sweep[k].key, value, problems);
      run.labels.emplace_back(c.sweep[k].key, yaml::flow_text(value));
    }
    auto scene = data::scene_from(root, c.scene_folder, problems);
    if (!scene) continue;
    const std::uint64_t seed = scene->seed;
    for (run.replica = 0; run.replica < c.replicas; ++run.replica) {
      if (run.replica > 0) {
        Node number = yaml::scalar(std::to_string(replica_seed(seed, run.replica)));
        number.mark = root.mark;
        root.set("seed", number);
        scene = data::scene_from(root, c.scene_folder, problems);
        if (!scene) break;
      }
      run.scene = *scene;
      run.hash12 = run_hash(run.scene.input_sha256);
      runs.push_back(run);
    }
  }
  return runs;
}

/// Canonical text and hash of the campaign: files count by content, scenes by their physics.
void describe_input(Campaign& c, Value value, const std::vector<Run>& runs) {
  std::string hashed;
  for (const Run& run : runs) hashed += run.scene.input_sha256 + "\n";
  for (const TrajectorySource& s : c.sources) hashed += s.hash + "\n";
  for (const coarse::Case& one : c.coarse) hashed += one.name + " " + one.input_sha256 + "\n";
  const auto read_back = [](const std::string& text, const Field& format) {
    Problems none;
    return yaml::validate(yaml::parse(text, "canonical text", none), format, none);
  };
  if (!runs.empty()) value.members["scene"] = read_back(runs.front().scene.source_text, data::scene_format());
  Value& cases = value.members["coarse"];
  cases.items.clear();
  for (const coarse::Case& one : c.coarse) {
    cases.items.push_back(read_back(one.source_text, coarse::case_format()));
    Value name;
    name.type = Value::Type::text;
    name.word = one.name;
    cases.items.back().members["name"] = name;
  }
  c.source_text = yaml::canonical_text(value);
  for (const char* key : {"scene", "coarse", "trajectories", "sweep"}) value.members.erase(key);
  c.input_sha256 = sha256(yaml::physical_text(value) + hashed);
}

/// Puts scene and case files in the place of their names and applies the overrides: those that may name files
/// first, then those that reach inside the files. Returns where the cases come from.
std::vector<Inlined> complete_document(Node& root, Campaign& c, const std::string& folder,
                                       const std::vector<std::string>& overrides, Problems& problems) {
  const auto may_name_a_file = [](const std::string& o) {
    const std::string key = o.substr(0, o.find('='));
    return key == "scene" || key == "coarse" ||
           (key.rfind("coarse.", 0) == 0 && yaml::split_path(key).size() == 2);
  };
  std::vector<std::string> first, second;
  for (const std::string& o : overrides) (may_name_a_file(o) ? first : second).push_back(o);
  yaml::apply_overrides(root, campaign_format(), first, problems);
  c.scene_folder = folder;
  if (Node* scene = root.find("scene")) {
    if (scene->type == Node::Type::null)
      problems.add(scene->mark, "scene: no value (a file or a map is expected) write scene: FILE");
    c.scene_folder = inline_file(*scene, folder, "", problems).folder;
  }
  std::vector<Inlined> cases;
  if (Node* list = root.find("coarse"))
    for (Node& one : list->items)
      cases.push_back(inline_file(one, folder, "coarse" + std::to_string(cases.size() + 1), problems));
  yaml::apply_overrides(root, campaign_format(), second, problems);
  return cases;
}

/// What a campaign starts from: a scene with its sweep, or trajectories.
void read_start(Campaign& c, const Node& root, Value& value, const std::string& folder, Problems& problems) {
  const Node *scene = root.find("scene"), *sweep = root.find("sweep");
  if (scene) c.scene = *scene;
  add_format(c.scene, data::scene_format());
  c.zip = value.has("zip") && value["zip"].boolean();
  c.replicas = value.has("replicas") ? static_cast<int>(value["replicas"].integer()) : 1;
  c.sweep = read_sweep(sweep, problems);
  check_sweep(c, sweep, problems);
  const auto sources = value.members.find("trajectories");
  const bool any_source = sources != value.members.end() && !sources->second.items.empty();
  if (value.type == Value::Type::map && !scene && !any_source)
    problems.add(root.mark,
                 "neither `scene` nor `trajectories` (a campaign starts from one of them) add scene: FILE");
  if (scene && any_source)
    problems.add(sources->second.mark,
                 "`scene` and `trajectories` together (a campaign starts from one of them) remove one");
  if (!scene && !c.sweep.empty())
    problems.add(sweep->mark, "`sweep` without `scene` (its keys are those of a scene) remove it");
  for (std::size_t i = 0; any_source && i < sources->second.items.size(); ++i)
    if (const auto source = read_source(sources->second.items[i], i, folder, problems)) {
      const auto copies = replicated(*source, c.replicas, i);
      c.sources.insert(c.sources.end(), copies.begin(), copies.end());
    }
}

void check_layer(const Value& value, Problems& problems) {
  const Value* layer = value.find("calibrate.layer");
  if (layer && layer->type == Value::Type::list && layer->items[0].number() >= layer->items[1].number())
    problems.add(layer->mark, "calibrate.layer: it ends below its start (lower height first) swap the two");
}

/// The rest, once everything is known to be valid.
void read_settings(Campaign& c, const Value& value) {
  const auto whole = [&](const char* path) { return static_cast<int>(value[path].integer()); };
  c.calibrate = calibration_of(value["calibrate"]);
  c.launcher = {value["launcher.type"].choice<Launcher::Type>(), whole("launcher.slots"),
                whole("launcher.ranks"), whole("launcher.threads")};
  c.on_failure = {value["on_failure.action"].choice<OnFailureAction>(), whole("on_failure.attempts")};
  c.out = value.has("out") ? value["out"].text() : "out/" + c.name;
}

}  // namespace

std::string Campaign::title() const {
  std::string text = name;
  std::string separator = ": ";
  for (const SweepKey& k : sweep) {
    const std::vector<std::string> parts = yaml::split_path(k.key);
    const bool item = parts.size() > 1 && parse_number(parts.back());  // size.1, not 1
    text += separator + (item ? parts[parts.size() - 2] + "." : "") + parts.back() + " =";
    for (std::size_t i = 0; i < k.values.size(); ++i) text += (i ? ", " : " ") + yaml::flow_text(k.values[i]);
    separator = zip ? " with " : " x ";
  }
  if (replicas > 1) text += separator + std::to_string(replicas) + " replicas";
  return text;
}

std::uint64_t Campaign::seed() const {
  if (const Node* s = scene.find("seed"))
    if (const auto x = parse_number(s->text)) return static_cast<std::uint64_t>(*x);
  for (const TrajectorySource& s : sources)
    if (s.type == TrajectorySource::Type::synthetic) return s.synthetic.seed;
  return 1;
}

std::string Campaign::calibrate_text() const {
  std::string text = calibrate.kind + " t0 " + format_number(calibrate.t0) + " lag " +
                     (calibrate.lag ? format_number(*calibrate.lag) : "auto");
  text += " layer " + (calibrate.core
                           ? format_number((*calibrate.core)[0]) + " " + format_number((*calibrate.core)[1])
                           : "auto");
  return text + " bootstrap " + std::to_string(calibrate.bootstrap) + " seed " +
         std::to_string(calibrate.seed);
}

std::uint64_t replica_seed(std::uint64_t seed, int replica) {
  if (replica == 0) return seed;
  const RandomBits b = random_bits(seed, Stream::replica, static_cast<std::uint64_t>(replica), 0);
  return (static_cast<std::uint64_t>(b.word[0]) << 21) | (b.word[1] >> 11);  // exact in a double and in JSON
}

std::string run_hash(const std::string& input_sha256) {
  return sha256(input_sha256 + "\n" + version()).substr(0, 12);
}

std::vector<Run> expand(const Campaign& campaign) {
  Problems problems;
  auto runs = expand(campaign, problems);
  problems.throw_if_any();
  return runs;
}

Campaign parse_campaign(const std::string& text, const std::string& name,
                        const std::vector<std::string>& overrides) {
  Problems problems;
  Campaign c;
  const std::string folder = data::folder_of(name);
  Node root = yaml::parse(text, name, problems);
  const auto case_origins = complete_document(root, c, folder, overrides, problems);
  Value value = yaml::validate(root, campaign_shell_format(), problems);
  c.name = value.has("name") ? value["name"].text() : std::filesystem::path(name).stem().string();
  read_start(c, root, value, folder, problems);
  check_layer(value, problems);
  c.coarse = read_cases(root.find("coarse"), case_origins, problems);
  std::vector<Run> runs;
  if (points_of(c) * static_cast<std::size_t>(c.replicas) <= most_runs) runs = expand(c, problems);
  problems.throw_if_any();
  read_settings(c, value);
  c.warnings = problems.warnings();
  describe_input(c, std::move(value), runs);
  return c;
}

Campaign read_campaign(const std::string& path, const std::vector<std::string>& overrides) {
  return parse_campaign(read_input_file(path), path, overrides);
}

}  // namespace hemowalk::workflow
