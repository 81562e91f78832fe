#include "core/log.hpp"

#include <spdlog/sinks/stdout_color_sinks.h>
#include <spdlog/spdlog.h>
#include <unistd.h>

namespace hemowalk {
namespace {

spdlog::logger& logger() {
  static const std::shared_ptr<spdlog::logger> instance = [] {
    auto made =
        std::make_shared<spdlog::logger>("hemowalk", std::make_shared<spdlog::sinks::stderr_color_sink_mt>());
    made->set_pattern(::isatty(STDERR_FILENO) ? "%^%l%$: %v" : "%Y-%m-%dT%H:%M:%S %l: %v");
    made->flush_on(spdlog::level::info);
    return made;
  }();
  return *instance;
}

}  // namespace

void set_log_level(LogLevel level) {
  constexpr spdlog::level::level_enum levels[] = {spdlog::level::err, spdlog::level::warn,
                                                  spdlog::level::info, spdlog::level::debug};
  logger().set_level(levels[static_cast<int>(level)]);
}

// The text is an argument, never a format: braces in file names stay braces.
void log_error(const std::string& line) { logger().error("{}", line); }
void log_warning(const std::string& line) { logger().warn("{}", line); }
void log_info(const std::string& line) { logger().info("{}", line); }
void log_debug(const std::string& line) { logger().debug("{}", line); }

}  // namespace hemowalk
