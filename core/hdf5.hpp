#pragma once
/// \file A small HDF5 wrapper: doubles and 64-bit integers in, doubles and 64-bit integers out, units on
/// every dataset.

#include <cstdint>
#include <string>
#include <vector>

namespace hemowalk::hdf5 {

using Shape = std::vector<std::size_t>;

/// An open file; closes itself. Paths are absolute ("/platelet/position"); groups are made as needed.
/// All members \throw IoError naming file and path when HDF5 fails, InputError when the content is not what
/// is asked for.
class File {
 public:
  static File create(const std::string& path);
  /// \throws InputError if \p path is no HDF5 file.
  static File open(const std::string& path);
  File(File&& other) noexcept;
  File& operator=(File&& other) noexcept;
  ~File();

  /// A dataset with attribute `units` ("m", "1/s"; "1" for dimensionless). \p data has the product of \p
  /// shape elements.
  void write(const std::string& path, const Shape& shape, const std::vector<double>& data,
             const std::string& units);
  void write(const std::string& path, const Shape& shape, const std::vector<std::int64_t>& data,
             const std::string& units);

  bool has(const std::string& path) const;
  /// Names of the groups inside \p group, sorted.
  std::vector<std::string> groups(const std::string& group) const;
  /// Names of the datasets inside \p group, sorted.
  std::vector<std::string> datasets(const std::string& group) const;
  Shape shape(const std::string& path) const;
  std::string units(const std::string& path) const;
  std::vector<double> read(const std::string& path) const;
  std::vector<std::int64_t> read_integers(const std::string& path) const;

  /// Attributes of the root.
  void write_attribute(const std::string& name, const std::string& text);
  void write_attribute(const std::string& name, double value);
  void write_attribute(const std::string& name, std::uint64_t value);
  void write_attribute(const std::string& name, const std::vector<double>& values);
  bool has_attribute(const std::string& name) const;
  std::string text_attribute(const std::string& name) const;
  std::vector<double> attribute(const std::string& name) const;
  std::uint64_t integer_attribute(const std::string& name) const;

  /// Flushes and closes, so that errors are seen; the destructor closes silently.
  void close();

 private:
  File(std::int64_t id, std::string path) : id_(id), path_(std::move(path)) {}
  std::int64_t id_ = -1;  ///< hid_t
  std::string path_;
};

}  // namespace hemowalk::hdf5
