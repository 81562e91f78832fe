#pragma once
/// \file Log lines on stderr; stdout belongs to results (--json).

#include <string>

namespace hemowalk {

enum class LogLevel { error, warning, info, debug };

/// Lines above \p level are dropped. Colours and no timestamps on a terminal, timestamps otherwise.
void set_log_level(LogLevel level);
void log_error(const std::string& line);
void log_warning(const std::string& line);
void log_info(const std::string& line);
void log_debug(const std::string& line);

}  // namespace hemowalk
