/// \file The formats by name, and the page that lists every key of every file.

#include <algorithm>

#include "core/data/formats.hpp"
#include "core/io.hpp"
#include "workflow/campaign.hpp"

namespace hemowalk::workflow {
namespace {

struct Format {
  const char *name, *file, *introduction;
  const yaml::Field& (*field)();
};

const Format formats[] = {
    {"scene", "scene.yaml",
     "What is simulated. Values carry their unit (`50 um`, `100 1/s`, `5 pN/um`); bare numbers only where "
     "dimensionless. All values "
     "are physical, whatever `acceleration` is. A choice with keys of its own may also be written around "
     "them: "
     "`law: {skalak: {Gs: 5 pN/um, C: 1}}`.",
     data::scene_format},
    {"campaign", "campaign.yaml",
     "A study: scenes and what is varied, or trajectories that exist already; then calibration and coarse "
     "cases. Inside a campaign "
     "scenes and cases need no `format:`.",
     campaign_format},
    {"coarse", "coarse.yaml", "Transport over the size of a device by walkers that follow a transport law.",
     coarse::case_format},
    {"law", "transport_law.yaml",
     "What calibration learned. Numbers in SI, the unit is part of the key; `null` = not known.",
     data::transport_law_format},
};

constexpr const char* page_head = R"(# Reference

Made by `hemowalk schema reference`; do not edit by hand. The same tables validate the files.

Every problem of a file is reported at once as `file:line:col: problem (why) suggestion`. Refused: duplicate keys, anchors and
aliases, `yes/no/on/off` for truth values, numbers with leading zeros, NaN and infinity, values without their unit.
`--set dotted.key=value` changes a value before it is checked; list items count from 0 (`--set domain.size.1=100um`).

## Exit codes

| code | meaning |
|---|---|
| 0 | done |
| 1 | internal error |
| 2 | bad input or usage |
| 3 | physics failed: blow-up, lost cell |
| 4 | refused: outside the validity range, or a failed gate with `--strict` |
| 5 | campaign ended with failed runs |
| 74 | disk or I/O |
| 75 | stopped with a checkpoint |

)";

constexpr const char* trajectories = R"(## trajectories.h5

HDF5, SI units, 64-bit floats; every dataset has the attribute `units`; axis order x, y, z; periodic axes unwrapped.
T samples, N cells of a kind, P profiles, Y heights, K diagnostics. NaN = not known.

| root attribute | meaning |
|---|---|
| `format` | `hemowalk.trajectories/1` |
| `version` | of the program that wrote the file |
| `acceleration` | s, for the record: all values are physical |
| `shear_rate` | 1/s |
| `box` | 3 lengths, m |
| `walls_y` | lower and upper wall, m |
| `hematocrit_true` | volume of the placed red cells over that of the box |
| `kappa_damping`, `t_c`, `Ca`, `Re` | membrane damping, shape-recovery time (s), capillary and Reynolds number |
| `seed`, `scene_yaml`, `input_sha256` | where it comes from |

| dataset | shape | units |
|---|---|---|
| `/time` | T | s |
| `/KIND/id` | N | 1 |
| `/KIND/position` | T x N x 3 | m |
| `/KIND/orientation` | T x N x 3 | 1 |
| `/KIND/taylor_deformation` | T x N | 1 |
| `/KIND/axial_diameter`, `transverse_diameter` | T x N | m |
| `/KIND/inclination`, `tank_treading_angle` | T x N | rad |
| `/KIND/area` | T x N | m2 |
| `/KIND/volume` | T x N | m3 |
| `/profile/time` | P | s |
| `/profile/y` | Y | m |
| `/profile/velocity` | P x Y x 3 | m/s |
| `/profile/hematocrit` | P x Y | 1 |
| `/profile/shear_stress` | P x Y | Pa |
| `/diagnostics/time` | K | s |
| `/diagnostics/momentum_residual` | K x 3 | 1 |
| `/diagnostics/energy_residual`, `mass_error`, `volume_error_max`, `max_speed_ratio` | K | 1 |
| `/diagnostics/overlap_max` | K | m |
| `/diagnostics/slip_rms` | K | m/s |
| `/diagnostics/power_in` (walls, body force, loads) | K | W |
| `/diagnostics/power_viscous`, `power_damping`, `power_slip`, `power_stressless` (lost; the last two to the lattice) | K | W |
| `/diagnostics/power_membranes`, `power_contact`, `power_inertia` (stored) | K | W |
)";

}  // namespace

std::string format_schema(const std::string& name) {
  std::vector<std::string> names;
  for (const Format& f : formats) {
    if (name == f.name) return yaml::json_schema(f.field(), f.file);
    names.emplace_back(f.name);
  }
  const std::string near = yaml::nearest(name, names);
  throw InputError("unknown format `" + name + "` (there are scene, campaign, coarse and law) " +
                   (near.empty() ? "choose one of them" : "did you mean `" + near + "`?"));
}

std::string reference_page() {
  std::string page = page_head;
  for (const Format& f : formats) page += yaml::reference_section(f.field(), f.file, f.introduction) + "\n";
  return page + trajectories;
}

std::string kind_of_file(const std::string& path) {
  yaml::Problems problems;
  const yaml::Node root = yaml::parse(read_input_file(path), path, problems);
  const yaml::Node* format = root.find("format");
  for (const Format& f : formats)
    if (format && format->text == f.field().keys.front().field.words.front()) return f.name;
  return {};
}

}  // namespace hemowalk::workflow
