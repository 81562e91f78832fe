#pragma once
/// \file Errors. Every message reads "<problem> (<why>) <suggestion>"; the type decides the exit code.

#include <stdexcept>
#include <string>

namespace hemowalk {

/// Exit codes of the program (docs/reference.md).
enum class Exit : int {
  done = 0,
  internal = 1,
  usage = 2,
  physics = 3,
  refused = 4,
  failed_runs = 5,
  io = 74,
  interrupted = 75
};

/// Base of all errors that carry an exit code.
struct Error : std::runtime_error {
  Error(Exit code_, const std::string& what) : std::runtime_error(what), code(code_) {}
  Exit code;
};
/// Bad input or usage: exit code 2.
struct InputError : Error {
  explicit InputError(const std::string& what) : Error(Exit::usage, what) {}
};
/// Blow-up, lost cell: exit code 3.
struct PhysicsError : Error {
  explicit PhysicsError(const std::string& what) : Error(Exit::physics, what) {}
};
/// Outside the stated validity, or a gate failed under --strict: exit code 4.
struct Refused : Error {
  explicit Refused(const std::string& what) : Error(Exit::refused, what) {}
};
/// Disk and file trouble: exit code 74.
struct IoError : Error {
  explicit IoError(const std::string& what) : Error(Exit::io, what) {}
};
/// Stopped by a signal after a checkpoint: exit code 75.
struct Interrupted : Error {
  explicit Interrupted(const std::string& what) : Error(Exit::interrupted, what) {}
};

/// Input check, always on. \throws InputError with \p message when \p condition is false.
inline void require(bool condition, const std::string& message) {
  if (!condition) throw InputError(message);
}
/// Overload for hot callers: the message is only built when the check fails.
template <class MakeMessage>
requires requires(MakeMessage m) { std::string(m()); }
void require(bool condition, MakeMessage&& make_message) {
  if (!condition) throw InputError(make_message());
}

/// Contract between parts of the program; compiled in checked builds only.
#if defined(HEMOWALK_CHECKED)
inline void contract(bool condition, const char* message) {
  if (!condition) throw std::logic_error(message);
}
#else
inline constexpr void contract(bool, const char*) {}
#endif

}  // namespace hemowalk
