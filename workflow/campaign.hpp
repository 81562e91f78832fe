#pragma once
/// \file Campaign: one study. Scenes with a sweep (or trajectories that exist already), calibration, coarse
/// cases.

#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "calibration/calibration.hpp"
#include "calibration/synthetic.hpp"
#include "coarse/case.hpp"
#include "core/data/scene.hpp"
#include "core/yaml/schema.hpp"

namespace hemowalk::workflow {

/// Trajectories that are not simulated: generated with a known answer, imported, or read.
struct TrajectorySource {
  enum class Type { synthetic, import, file } type = Type::synthetic;
  std::string name;
  bool optional = false;  ///< skipped with a warning when absent; absent non-optional ones are errors
  bool present = true;    ///< the folder or file exists (synthetic: always)
  calibration::Synthetic synthetic;
  std::string path;  ///< import: folder of text files; file: trajectories.h5; absolute
  std::string text;  ///< canonical YAML of this source
  std::string
      hash;  ///< 12 digits of the SHA-256 of what decides the data (contents, not names) and the version
  std::size_t point = 0;  ///< number of the list entry; its replicas differ in their seed only
  int replica = 0;        ///< synthetic sources are replicated like scenes
};

struct Launcher {
  enum class Type { local, slurm } type = Type::local;
  int slots = 1;    ///< runs at a time
  int ranks = 1;    ///< per run
  int threads = 0;  ///< per rank; 0 = what the machine has, shared among the slots
};

enum class OnFailureAction { abort, retry, skip };
struct FailurePolicy {
  OnFailureAction action = OnFailureAction::abort;
  int attempts = 2;  ///< retry: how often a run is started in all
};

/// One swept key ("fluid.tau") and its values, as they stand in the campaign file.
struct SweepKey {
  std::string key;
  std::vector<yaml::Node> values;
};

struct Campaign {
  std::string name;             ///< file stem, or the `name:` key
  yaml::Node scene;             ///< null when `sources` are given instead
  std::string scene_folder;     ///< file names in the scene are relative to it
  std::vector<SweepKey> sweep;  ///< in the order of the file
  bool zip = false;             ///< values of equal position together instead of the product
  int replicas = 1;             ///< runs per point, same scene, other seeds
  std::vector<TrajectorySource> sources;
  calibration::Options calibrate;
  std::vector<coarse::Case> coarse;  ///< a case with neither law_file nor constant_D uses the campaign's law
  Launcher launcher;
  FailurePolicy on_failure;
  std::string out;                    ///< folder of results, relative to the working directory
  std::string source_text;            ///< canonical YAML of the whole campaign, its scene file included
  std::string input_sha256;           ///< of what decides the results (not of launcher, on_failure, out)
  std::vector<std::string> warnings;  ///< keys without effect, absent optional sources

  /// "name: kappa_damping = 0.5, 0.9 x 3 replicas": one line for people.
  std::string title() const;
  /// The scene's seed (the first synthetic source's without a scene).
  std::uint64_t seed() const;
  /// Canonical text of the calibrate settings.
  std::string calibrate_text() const;
};

/// One simulation of a campaign.
struct Run {
  std::string hash12;     ///< of the scene's physics and the program version: names the run folder
  data::Scene scene;      ///< swept values and the replica's seed are in it
  std::size_t point = 0;  ///< number of the sweep point; runs of one point differ in their seed only
  int replica = 0;
  std::vector<std::pair<std::string, std::string>> labels;  ///< swept key -> text of its value
};

/// The format of campaign.yaml.
const yaml::Field& campaign_format();
/// The same with scene, sweep and cases unread: they are validated on their own, sweep values filled in.
const yaml::Field& campaign_shell_format();

/// Reads campaign.yaml. \throws InputError listing every problem as file:line:col, those in scene and coarse
/// files too. \p overrides ("scene.fluid.tau=1", "replicas=3") are applied before validation.
Campaign read_campaign(const std::string& path, const std::vector<std::string>& overrides = {});
Campaign parse_campaign(const std::string& text, const std::string& name,
                        const std::vector<std::string>& overrides = {});

/// All runs of a campaign, points in the order of the sweep (last key fastest), replicas together; empty
/// without a scene. \throws InputError listing the problems of all scenes, each once.
std::vector<Run> expand(const Campaign& campaign);

/// The seed of a replica: the scene's own for the first, else a 53-bit number that depends on both.
std::uint64_t replica_seed(std::uint64_t seed, int replica);

/// Name of a run folder: 12 digits of the SHA-256 of an input hash and the program version.
std::string run_hash(const std::string& input_sha256);

/// What kind of file a document is: "scene", "campaign", "coarse", "law"; empty if `format:` says none of
/// them.
std::string kind_of_file(const std::string& path);

/// JSON Schema of scene | campaign | law | coarse. \throws InputError for other names.
std::string format_schema(const std::string& name);
/// docs/reference.md: every key of every file.
std::string reference_page();

}  // namespace hemowalk::workflow
