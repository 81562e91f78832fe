#pragma once
/// \file Where a file came from: version, build, hashes.

#include <string>
#include <string_view>

namespace hemowalk {

/// Version of the program, "0.1.0".
std::string version();
/// Commit it was built from, 12 digits; empty when built outside a repository.
std::string commit();
/// "Release, GCC 12.2.0".
std::string build_description();
/// "hemowalk 0.1.0 (commit 0123456789ab, Release, GCC 12.2.0)".
std::string program_description();

/// SHA-256 as 64 lower-case hexadecimal digits.
std::string sha256(std::string_view bytes);
/// SHA-256 of a file's content. \throws IoError.
std::string sha256_of_file(const std::string& path);

}  // namespace hemowalk
