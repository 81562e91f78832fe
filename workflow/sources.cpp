#include "workflow/sources.hpp"

#include <fmt/format.h>

#include <chrono>
#include <filesystem>

#include "calibration/calibration.hpp"
#include "core/check.hpp"
#include "core/io.hpp"
#include "core/provenance.hpp"
#include "workflow/run_directory.hpp"

namespace hemowalk::workflow {

namespace {

using Type = TrajectorySource::Type;

data::Trajectories trajectories_of(const TrajectorySource& source) {
  switch (source.type) {
    case Type::import:
      return calibration::import_text_folder(source.path);
    case Type::file:
      return data::read_trajectories(source.path);
    default:
      return calibration::generate(source.synthetic);
  }
}

}  // namespace

void make_trajectories(const TrajectorySource& source, const std::string& folder) {
  const auto start = std::chrono::steady_clock::now();
  std::filesystem::create_directories(folder);
  Status status = read_status(folder).value_or(Status{});
  status.attempt += 1;
  const auto save = [&](State state, int code, const std::string& reason) {
    status.state = state, status.exit_code = code, status.reason = reason;
    status.wall += std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    write_status(folder, status);
  };
  try {
    write_file_atomic(folder + "/source.yaml", source.text);
    auto trajectories = trajectories_of(source);
    if (trajectories.input_sha256.empty()) trajectories.input_sha256 = sha256(source.text);
    data::write_trajectories(trajectories, folder + "/trajectories.h5");
    status.progress = 1;
    save(State::done, 0, "finished");
  } catch (const Error& error) {
    save(State::failed, static_cast<int>(error.code), error.what());
    throw;
  }
}

std::string describe(const TrajectorySource& source) {
  const auto& s = source.synthetic;
  switch (source.type) {
    case Type::import:
      return "imported text files, " + std::filesystem::path(source.path).filename().string();
    case Type::file:
      return "trajectories from " + std::filesystem::path(source.path).filename().string();
    default:
      return fmt::format("synthetic with known truth: {} platelets, D = {:.3g} m²/s{}{}", s.platelets, s.D,
                         s.D_contrast != 0 ? fmt::format(" (1 {} {:.2g} cos 2πy/H)",
                                                         s.D_contrast > 0 ? "+" : "−", std::abs(s.D_contrast))
                                           : "",
                         s.memory > 0 ? fmt::format(", velocity memory {:.3g} ms", s.memory * 1e3) : "");
  }
}

nlohmann::ordered_json truth_json(const TrajectorySource& source) {
  if (source.type != Type::synthetic) return nullptr;
  nlohmann::ordered_json truth;
  for (int i = 0; i <= 100; ++i) {
    const double y = source.synthetic.gap * i / 100;
    truth["y_m"].push_back(y);
    truth["D_m2_per_s"].push_back(calibration::true_D(source.synthetic, y));
  }
  return truth;
}

}  // namespace hemowalk::workflow
