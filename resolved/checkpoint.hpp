#pragma once
/// \file Checkpoints: the complete state of a run in one file, written whole or not at all, with a checksum.

#include <string>
#include <vector>

#include "core/view.hpp"

namespace hemowalk::resolved {

/// Named parts of a checkpoint (solver state, recorder sums).
struct Checkpoint {
  std::string input_sha256;  ///< of the scene it belongs to
  std::string version;       ///< of the program
  std::vector<std::byte> solver;
  std::vector<double> recorder;
};

/// zstd-compressed, SHA-256 of the content in the head; tmp + fsync + rename. \throws IoError.
void write_checkpoint(const Checkpoint& checkpoint, const std::string& path);
/// \throws InputError when damaged or not a checkpoint, IoError when unreadable.
Checkpoint read_checkpoint(const std::string& path);

}  // namespace hemowalk::resolved
