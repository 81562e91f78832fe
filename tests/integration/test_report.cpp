/// \file The report: complete in itself, drawn without errors in a real browser, and honest when it is not.

#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <numbers>

#include "integration/program.hpp"
#include "workflow/report.hpp"
#include "workflow/results.hpp"

namespace hemowalk::test {
namespace {

using workflow::render_report;
using Json = nlohmann::ordered_json;

/// What the page wrote about itself after drawing in a headless browser; empty if there is no browser.
std::string self_check(const Scratch& scratch, const std::string& page) {
  if (std::system("command -v chromium >/dev/null 2>&1") != 0) return "";
  const auto file = scratch.write("page.html", page), profile = (scratch.path() / "profile").string(),
             dom = (scratch.path() / "dom.html").string();
  const std::string command =
      "timeout 100 chromium --headless --no-sandbox --disable-gpu --disable-quic --no-first-run "
      "--disable-background-networking"
      " --disable-component-update --disable-sync --user-data-dir='" +
      profile + "' --virtual-time-budget=5000 --dump-dom 'file://" + file + "' >'" + dom + "' 2>/dev/null";
  if (std::system(command.c_str()) != 0) return "";
  const std::string text = slurp(dom);
  const auto start = text.rfind("<div id=\"selfcheck\"");
  return start == std::string::npos ? "the page has no self-check"
                                    : text.substr(start, text.find('>', start) - start + 1);
}

int charts_in(const std::string& check) {
  const auto at = check.find("data-charts=\"");
  return at == std::string::npos ? -1 : std::atoi(check.c_str() + at + 13);
}

const char* const campaign =
    "format: hemowalk.campaign/1\n"
    "trajectories:\n"
    "  - {name: one </script><b>, synthetic: {platelets: 20, duration: 600 ms}}\n"
    "  - {name: two, synthetic: {platelets: 20, duration: 600 ms, D_contrast: -0.5, seed: 2}}\n"
    "calibrate: {t0: 100 ms, bootstrap: 50}\n"
    "coarse: [{name: device, walkers: 1e4, dt: 1 s, end: 60 s, output: [20 s, 40 s, 60 s]}]\n"
    "out: results\n";

TEST(Report, LoadsNothingAndItsDataCannotEndTheScript) {
  Json results;
  results["title"] = "a </script><script>alert(1)</script> title";
  const std::string page = render_report(results);
  EXPECT_EQ(page.find("</script><script>alert"), std::string::npos);
  for (const char* loader : {"src=\"", "href=\"http", "url(http", "@import", "fetch("})
    EXPECT_EQ(page.find(loader), std::string::npos) << loader;
  EXPECT_EQ(page.find("@RESULTS@"), std::string::npos);
  EXPECT_EQ(page.find("@UPLOT_JS@"), std::string::npos);
}

TEST(Report, DrawsAllChartsInABrowser) {
  const Scratch scratch;
  scratch.write("campaign.yaml", campaign);
  const auto outcome = hemowalk(scratch, "run campaign.yaml");
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  const std::string check = self_check(scratch, slurp(scratch.path() / "results/report.html"));
  if (check.empty()) GTEST_SKIP() << "no chromium on this machine";
  EXPECT_NE(check.find("data-verdict=\"all charts drawn\""), std::string::npos) << check;
  EXPECT_NE(check.find("data-errors=\"\""), std::string::npos) << check;
  // 4 MSD, record, kurtosis, unseen cells, D(y), v(y), density, absorbed fraction, concentration
  EXPECT_EQ(charts_in(check), 12) << check;
}

TEST(Report, SelfCheckSeesABrokenPage) {
  const Scratch scratch;
  Json results;
  results["points"] = 5;  // no list: the page's script stumbles
  const std::string check = self_check(scratch, render_report(results));
  if (check.empty()) GTEST_SKIP() << "no chromium on this machine";
  EXPECT_EQ(check.find("data-verdict=\"all charts drawn\""), std::string::npos) << check;
}

/// Method section 11: D = 1e-10, H = 0.82 mm.
TEST(Report, ExactSeriesOfTheAbsorbingSlab) {
  const double H = 0.82e-3, times[] = {20, 60, 120, 300}, fractions[] = {0.062, 0.107, 0.151, 0.238};
  for (int i = 0; i < 4; ++i)
    EXPECT_NEAR(workflow::absorbed_fraction(1e-10, H, times[i], 1), fractions[i], 5e-4) << times[i];
  // Both sides of the switch between the short-time form and the series: they differ by the slope only.
  const double s = 5e-3, below = workflow::absorbed_fraction(1, 1, s * (1 - 1e-9), 1),
               above = workflow::absorbed_fraction(1, 1, s * (1 + 1e-9), 1);
  EXPECT_NEAR(above - below, 2e-9 * s / std::sqrt(std::numbers::pi * s), 1e-12);
  EXPECT_DOUBLE_EQ(workflow::absorbed_fraction(1e-10, H, 60, 2),
                   workflow::absorbed_fraction(1e-10, H / 2, 60, 1));
}

}  // namespace
}  // namespace hemowalk::test
