/// \file The table of campaign.yaml.

#include "core/data/formats.hpp"
#include "workflow/campaign.hpp"

namespace hemowalk::workflow {
namespace {

using yaml::Field;

/// A format whose `format:` key may be left out: inside a campaign it is clear what is meant.
Field inside_campaign(Field format) {
  yaml::Key& key = format.keys.front();
  key.presence = yaml::Key::Presence::defaulted;
  key.fallback = key.field.words.front();
  return format;
}

Field source_format() {
  using namespace yaml;
  const Field duration = quantity("s", "ms"), length = quantity("m", "um"),
              share = number().at_least(0).at_most(1);
  return map_of({
      optional("synthetic",
               map_of({with_default("platelets", integer().at_least(2).at_most(1e6), "95", "number of cells"),
                       with_default("duration", duration.above(0), "1 s", "length of the record"),
                       with_default("sample", duration.above(0), "1 ms", "interval of samples"),
                       with_default("gap", length.above(0), "50 um", "between two reflecting walls"),
                       with_default("D", quantity("m2/s", "um2/s").above(0), "100 um2/s",
                                    "diffusivity, mean over the gap"),
                       with_default("D_contrast", number().above(-1).below(1), "0",
                                    "D(y) = D (1 + contrast cos(2 pi y/gap))"),
                       with_default("memory", duration.at_least(0), "0 ms", "of the velocity; 0 = Brownian"),
                       with_default("jump_fraction", share, "0", "share of samples hit by a jump"),
                       with_default("jump_size", length.at_least(0), "0 um", "rms size of the jumps"),
                       with_default("shear_rate", quantity("1/s", "1/s"), "100 1/s", "advection along z"),
                       with_default("hematocrit", number().at_least(0).below(0.9), "0.35",
                                    "a label, carried along"),
                       with_default("seed", integer().at_least(0), "1", "of the random numbers")}),
               "trajectories with a known answer"),
      optional("import", text(), "folder of text files `iT, x, y, z`, one per platelet"),
      optional("file", text(), "a trajectories.h5"),
      optional("name", text(), "for tables and charts").not_physical(),
      with_default("optional", boolean(), "false", "skip it with a warning when it does not exist")
          .not_physical(),
  });
}

/// The campaign's table. With \p whole the scene and the cases are described inside; without, they pass
/// unread.
Field build_format(bool whole) {
  using namespace yaml;
  const Field scene = whole ? any_of({text(), inside_campaign(data::scene_format())}) : anything();
  const Field one_case = whole ? any_of({text(), inside_campaign(coarse::case_format())}) : anything();
  const Field sweep = whole ? dictionary(list_of(anything(), 1)) : anything();
  return map_of({
      format_key("hemowalk.campaign/1"),
      optional("name", text(), "the file's own name by default").not_physical(),
      optional("scene", scene, "a scene file, or a scene written here"),
      with_default("sweep", sweep, "{}", "dotted keys of the scene and their values: [..]"),
      with_default("zip", boolean(), "false",
                   "true: first values together, second values together, ..; false: all combinations"),
      with_default("replicas", integer().at_least(1).at_most(1000), "1", "runs per point with other seeds"),
      with_default("trajectories", list_of(source_format()), "[]", "instead of a scene: what exists already"),
      with_default(
          "calibrate",
          map_of(
              {with_default("kind", text(), "platelet", "kind of cell"),
               with_default("t0", quantity("s", "ms").at_least(0), "300 ms", "start of the window"),
               with_default("lag", any_of({choice({"auto"}), quantity("s", "ms").above(0)}), "auto",
                            "lag of the plateau"),
               with_default("layer", any_of({choice({"auto"}), list_of(quantity("m", "um"), 2, 2)}), "auto",
                            "heights where the core starts and ends"),
               with_default("bootstrap", integer().at_least(0).at_most(1e6), "1000", "number of resamples"),
               with_default("seed", integer().at_least(0), "1", "of the resampling")}),
          "{}", "from trajectories to a transport law"),
      with_default("coarse", list_of(one_case), "[]", "coarse cases: files, or written here"),
      with_default(
          "launcher",
          map_of({with_default("type", choice({"local", "slurm"}), "local", "who starts the runs"),
                  with_default("slots", integer().at_least(1).at_most(100000), "1", "runs at a time"),
                  with_default("ranks", integer().at_least(1).at_most(100000), "1", "processes per run"),
                  with_default("threads", integer().at_least(0).at_most(1024), "0",
                               "per process; 0 = the cores shared among the slots")}),
          "{}", "where runs are executed")
          .not_physical(),
      with_default("on_failure",
                   map_of({with_default("action", choice({"abort", "retry", "skip"}), "abort",
                                        "what happens when a run fails"),
                           with_default("attempts", integer().at_least(1).at_most(100), "2",
                                        "retry: starts of a run in all")}),
                   "{}", "failed runs")
          .not_physical(),
      optional("out", text(), "folder of results; out/NAME by default").not_physical(),
  });
}

}  // namespace

const Field& campaign_format() {
  static const Field format = build_format(true);
  return format;
}

const Field& campaign_shell_format() {
  static const Field format = build_format(false);
  return format;
}

}  // namespace hemowalk::workflow
