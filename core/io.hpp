#pragma once
/// \file Files that are either the old one or the whole new one, and errors that say why.

#include <string>

namespace hemowalk {

/// "<what> `path`: <text of errno> (<why>)": \throws IoError built from the current errno.
[[noreturn]] void throw_io_error(const std::string& what, const std::string& path);

/// The whole file. \throws IoError if it cannot be read or is larger than \p limit bytes.
std::string read_file(const std::string& path, std::size_t limit = std::size_t{1} << 28);

/// The same for a file the user named: one that does not exist or is a folder is bad input. \throws
/// InputError, IoError.
std::string read_input_file(const std::string& path);

/// Writes \p text to a temporary file beside \p path, syncs it to the disk and renames it. \throws IoError.
void write_file_atomic(const std::string& path, const std::string& text);

/// For writers that need a file name (HDF5): write to temporary(), then commit(). Without commit() nothing
/// remains.
class AtomicFile {
 public:
  /// Creates the folder of \p path if it does not exist. \throws IoError.
  explicit AtomicFile(std::string path);
  ~AtomicFile();
  AtomicFile(const AtomicFile&) = delete;
  AtomicFile& operator=(const AtomicFile&) = delete;

  const std::string& temporary() const { return temporary_; }
  /// fsync, rename, fsync of the folder. The writer must have closed the file. \throws IoError.
  void commit();

 private:
  std::string path_, temporary_;
  bool committed_ = false;
};

}  // namespace hemowalk
