#include "core/io.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <memory>
#include <utility>

#include "core/check.hpp"

namespace hemowalk {
namespace {

std::string hint(int code) {
  switch (code) {
    case ENOENT:
      return "no such file or folder) check the name";
    case EACCES:
    case EPERM:
      return "no permission) check the owner and mode of the file and its folder";
    case ENOSPC:
      return "the disk is full) free some space or choose another folder";
    case EROFS:
      return "the file system is read-only) choose another folder";
    case EISDIR:
      return "it is a folder) name a file";
    default:
      return std::string(std::strerror(code)) + ")";
  }
}

/// Flushes a file or folder to the disk.
void sync_path(const std::string& path, int flags) {
  const int fd = ::open(path.c_str(), flags);
  if (fd < 0) throw_io_error("cannot open", path);
  const int failed = ::fsync(fd);
  const int code = errno;
  ::close(fd);
  errno = code;
  if (failed && code != EINVAL) throw_io_error("cannot sync", path);  // EINVAL: the file system has no sync
}

}  // namespace

void throw_io_error(const std::string& what, const std::string& path) {
  throw IoError(what + " `" + path + "` (" + hint(errno));
}

std::string read_file(const std::string& path, std::size_t limit) {
  const std::unique_ptr<std::FILE, int (*)(std::FILE*)> file(std::fopen(path.c_str(), "rb"), std::fclose);
  if (!file) throw_io_error("cannot read", path);
  struct stat info {};
  if (::fstat(::fileno(file.get()), &info) == 0 && S_ISDIR(info.st_mode)) {
    errno = EISDIR;
    throw_io_error("cannot read", path);
  }
  std::string text;
  char buffer[1 << 16];
  std::size_t n = 0;
  while ((n = std::fread(buffer, 1, sizeof buffer, file.get())) > 0) {
    text.append(buffer, n);
    if (text.size() > limit)
      throw IoError("cannot read `" + path + "` (larger than " + std::to_string(limit) +
                    " bytes) is it the right file?");
  }
  if (std::ferror(file.get())) throw_io_error("cannot read", path);
  return text;
}

std::string read_input_file(const std::string& path) {
  std::error_code error;
  const auto status = std::filesystem::status(path, error);
  require(std::filesystem::exists(status),
          [&] { return path + ": no such file (it was to be read) check the name"; });
  require(!std::filesystem::is_directory(status),
          [&] { return path + ": a folder (a file is expected) name the file inside"; });
  return read_file(path);
}

AtomicFile::AtomicFile(std::string path)
    : path_(std::move(path)), temporary_(path_ + ".tmp" + std::to_string(::getpid())) {
  const auto folder = std::filesystem::path(path_).parent_path();
  if (folder.empty()) return;
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  if (error) {
    errno = error.value();
    throw_io_error("cannot create folder", folder.string());
  }
}

AtomicFile::~AtomicFile() {
  if (!committed_) ::unlink(temporary_.c_str());
}

void AtomicFile::commit() {
  sync_path(temporary_, O_RDWR);
  if (::rename(temporary_.c_str(), path_.c_str()) != 0) throw_io_error("cannot rename to", path_);
  committed_ = true;
  const auto folder = std::filesystem::path(path_).parent_path();
  sync_path(folder.empty() ? "." : folder.string(), O_RDONLY | O_DIRECTORY);
}

void write_file_atomic(const std::string& path, const std::string& text) {
  AtomicFile target(path);
  std::FILE* file = std::fopen(target.temporary().c_str(), "wb");
  if (!file) throw_io_error("cannot create", target.temporary());
  const bool written = std::fwrite(text.data(), 1, text.size(), file) == text.size();
  const int code = errno;
  const bool closed = std::fclose(file) == 0;
  if (!written || !closed) {
    if (!written) errno = code;
    throw_io_error("cannot write", target.temporary());
  }
  target.commit();
}

}  // namespace hemowalk
