#include "core/progress.hpp"

#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <limits>
#include <utility>

#include "core/log.hpp"

namespace hemowalk {
namespace {

Progress::Output standard_error() {
  Progress::Output output;
  output.terminal = ::isatty(STDERR_FILENO);
  output.clock = [] {
    return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
  };
  if (output.terminal)
    output.write = [](const std::string& text) { std::fputs(text.c_str(), stderr); };
  else
    output.write = [](const std::string& text) { log_info(text.substr(0, text.find('\n'))); };
  return output;
}

}  // namespace

std::string format_duration(double seconds) {
  if (!std::isfinite(seconds) || seconds < 0 || seconds > 1e10) return "?";
  const auto whole = static_cast<long long>(std::llround(seconds));
  char buffer[64];
  if (whole < 60)
    std::snprintf(buffer, sizeof buffer, "%lld s", whole);
  else if (whole < 3600)
    std::snprintf(buffer, sizeof buffer, "%lld:%02lld", whole / 60, whole % 60);
  else
    std::snprintf(buffer, sizeof buffer, "%lld:%02lld:%02lld", whole / 3600, whole / 60 % 60, whole % 60);
  return buffer;
}

std::string progress_line(const std::string& title, double fraction, double elapsed, const std::string& note,
                          int width) {
  fraction = std::isfinite(fraction) ? std::clamp(fraction, 0.0, 1.0) : 0.0;
  std::string line = title;
  if (width > 0) {
    const auto filled = static_cast<std::size_t>(fraction * width);
    line +=
        " [" + std::string(filled, '#') + std::string(static_cast<std::size_t>(width) - filled, '-') + "]";
  }
  char percent[16];
  std::snprintf(percent, sizeof percent, " %3.0f %%", std::floor(100 * fraction));
  line += percent;
  if (fraction >= 1)
    line += "  took " + format_duration(elapsed);
  else if (fraction > 0)
    line += "  left " + format_duration(elapsed * (1 - fraction) / fraction);
  if (!note.empty()) line += "  " + note;
  return line;
}

Progress::Progress(std::string title) : Progress(std::move(title), standard_error()) {}

Progress::Progress(std::string title, Output output)
    : title_(std::move(title)),
      output_(std::move(output)),
      start_(output_.clock()),
      last_(-std::numeric_limits<double>::infinity()) {
  if (output_.interval <= 0) output_.interval = output_.terminal ? 0.2 : 30;
  if (!output_.terminal) last_ = start_;  // a short job leaves one line, not two
}

Progress::~Progress() {
  if (output_.terminal && drawn_ && !finished_) output_.write("\n");
}

void Progress::update(double fraction, const std::string& note) {
  if (finished_) return;
  finished_ = fraction >= 1;
  const double now = output_.clock();
  if (!finished_ && now - last_ < output_.interval) return;
  last_ = now;
  drawn_ = true;
  const std::string line = progress_line(title_, fraction, now - start_, note, output_.terminal ? 30 : 0);
  if (output_.terminal)
    output_.write("\r" + line + "\x1b[K" + (finished_ ? "\n" : ""));  // erase what a longer line left behind
  else
    output_.write(line + "\n");
}

}  // namespace hemowalk
