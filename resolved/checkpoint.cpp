#include "resolved/checkpoint.hpp"

#include <zstd.h>

#include <cstring>

#include "core/check.hpp"
#include "core/io.hpp"
#include "core/provenance.hpp"

namespace hemowalk::resolved {

namespace {

constexpr std::string_view magic = "hemowalk.checkpoint/1\n";
constexpr std::size_t digest_length = 64;

void put(std::string& out, const void* data, std::uint64_t bytes) {
  out.append(reinterpret_cast<const char*>(&bytes), sizeof(bytes));
  out.append(static_cast<const char*>(data), bytes);
}

std::string_view take(std::string_view& in) {
  std::uint64_t bytes = 0;
  require(in.size() >= sizeof(bytes),
          "the checkpoint ends too early (it is damaged) remove it to start afresh");
  std::memcpy(&bytes, in.data(), sizeof(bytes));
  in.remove_prefix(sizeof(bytes));
  require(in.size() >= bytes, "the checkpoint ends too early (it is damaged) remove it to start afresh");
  const auto part = in.substr(0, bytes);
  in.remove_prefix(bytes);
  return part;
}

}  // namespace

void write_checkpoint(const Checkpoint& checkpoint, const std::string& path) {
  std::string raw;
  put(raw, checkpoint.input_sha256.data(), checkpoint.input_sha256.size());
  put(raw, checkpoint.version.data(), checkpoint.version.size());
  put(raw, checkpoint.solver.data(), checkpoint.solver.size());
  put(raw, checkpoint.recorder.data(), checkpoint.recorder.size() * sizeof(double));
  std::string packed(ZSTD_compressBound(raw.size()), '\0');
  const std::size_t n = ZSTD_compress(packed.data(), packed.size(), raw.data(), raw.size(), 1);
  if (ZSTD_isError(n))
    throw IoError(std::string("cannot compress the checkpoint (") + ZSTD_getErrorName(n) + ")");
  packed.resize(n);
  const std::uint64_t length = raw.size();
  std::string out(magic);
  out += sha256(raw);
  out.append(reinterpret_cast<const char*>(&length), sizeof(length));
  out += packed;
  write_file_atomic(path, out);
}

Checkpoint read_checkpoint(const std::string& path) {
  const std::string file = read_file(path, std::size_t{1} << 36);
  const std::size_t head = magic.size() + digest_length + sizeof(std::uint64_t);
  require(file.size() > head && std::string_view(file).substr(0, magic.size()) == magic,
          path + " is not a checkpoint of this program (its head is missing) remove it to start afresh");
  std::uint64_t length = 0;
  std::memcpy(&length, file.data() + magic.size() + digest_length, sizeof(length));
  require(length < (std::uint64_t{1} << 38), path + " is damaged (absurd length) remove it to start afresh");
  std::string raw(length, '\0');
  const std::size_t n = ZSTD_decompress(raw.data(), raw.size(), file.data() + head, file.size() - head);
  require(!ZSTD_isError(n) && n == length && sha256(raw) == file.substr(magic.size(), digest_length),
          path + " is damaged (its checksum does not match) remove it to start afresh");
  std::string_view in = raw;
  Checkpoint c;
  c.input_sha256 = take(in);
  c.version = take(in);
  const auto solver = take(in);
  c.solver.resize(solver.size());
  if (!solver.empty()) std::memcpy(c.solver.data(), solver.data(), solver.size());
  const auto recorder = take(in);
  c.recorder.resize(recorder.size() / sizeof(double));
  if (!recorder.empty()) std::memcpy(c.recorder.data(), recorder.data(), recorder.size());
  return c;
}

}  // namespace hemowalk::resolved
