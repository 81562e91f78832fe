#pragma once
/// \file The report: results.json inside one self-contained HTML page.

#include <nlohmann/json.hpp>
#include <string>

namespace hemowalk::workflow {

/// The page with \p results embedded; opens in any browser, needs no network.
std::string render_report(const nlohmann::ordered_json& results);

}  // namespace hemowalk::workflow
