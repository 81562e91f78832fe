#include "core/hdf5.hpp"

#include <hdf5.h>

#include <algorithm>
#include <filesystem>
#include <numeric>
#include <utility>

#include "core/check.hpp"
#include "core/io.hpp"

namespace hemowalk::hdf5 {
namespace {

static_assert(sizeof(hid_t) == sizeof(std::int64_t));

/// Any HDF5 identifier; closed by its own function.
class Handle {
 public:
  Handle(hid_t id, herr_t (*close)(hid_t)) : id_(id), close_(close) {}
  Handle(const Handle&) = delete;
  Handle& operator=(const Handle&) = delete;
  ~Handle() {
    if (id_ >= 0) close_(id_);
  }
  operator hid_t() const { return id_; }
  bool good() const { return id_ >= 0; }

 private:
  hid_t id_;
  herr_t (*close_)(hid_t);
};

/// HDF5 prints a stack of its own on stderr unless told not to.
void silence() { H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr); }

/// The innermost message of HDF5's error stack.
std::string reason() {
  std::string text = "HDF5";
  H5Ewalk2(
      H5E_DEFAULT, H5E_WALK_UPWARD,
      [](unsigned n, const H5E_error2_t* error, void* out) -> herr_t {
        if (n == 0 && error->desc) *static_cast<std::string*>(out) = std::string("HDF5: ") + error->desc;
        return 0;
      },
      &text);
  return text;
}

[[noreturn]] void fail(const std::string& what, const std::string& file, const std::string& path) {
  throw IoError("cannot " + what + " `" + file + ":" + path + "` (" + reason() +
                ") check the disk and the file");
}

[[noreturn]] void bad_content(const std::string& file, const std::string& path, const std::string& problem) {
  throw InputError(file + ":" + path + ": " + problem);
}

std::vector<hsize_t> dimensions(const Shape& shape) { return {shape.begin(), shape.end()}; }

std::size_t product(const Shape& shape) {
  return std::accumulate(shape.begin(), shape.end(), std::size_t{1}, std::multiplies<>());
}

/// HDF5 takes no null pointer even for no elements.
template <class T>
const void* data_of(const std::vector<T>& data) {
  static const T none{};
  return data.empty() ? &none : data.data();
}

Handle text_type(std::size_t length) {
  const hid_t type = H5Tcopy(H5T_C_S1);
  H5Tset_size(type, std::max<std::size_t>(length, 1));
  H5Tset_cset(type, H5T_CSET_UTF8);
  return {type, H5Tclose};
}

void put_text(hid_t object, const std::string& name, const std::string& text, const std::string& file) {
  const Handle type = text_type(text.size()), space(H5Screate(H5S_SCALAR), H5Sclose);
  const Handle attribute(H5Acreate2(object, name.c_str(), type, space, H5P_DEFAULT, H5P_DEFAULT), H5Aclose);
  if (!attribute.good() || H5Awrite(attribute, type, text.empty() ? "" : text.data()) < 0)
    fail("write attribute", file, name);
}

std::string get_text(hid_t object, const std::string& name, const std::string& file) {
  const Handle attribute(H5Aopen(object, name.c_str(), H5P_DEFAULT), H5Aclose);
  if (!attribute.good())
    bad_content(file, name,
                "the attribute is missing (every file of this format has it) is the file complete?");
  const Handle type(H5Aget_type(attribute), H5Tclose);
  if (H5Tget_class(type) != H5T_STRING)
    bad_content(file, name, "the attribute is not a text (a text is expected) rewrite the file");
  std::string text;
  if (H5Tis_variable_str(type) > 0) {  // files of other programs, h5py for one
    char* buffer = nullptr;
    const Handle memory(H5Tcopy(H5T_C_S1), H5Tclose);
    H5Tset_size(memory, H5T_VARIABLE);
    H5Tset_cset(memory, H5Tget_cset(type));
    if (H5Aread(attribute, memory, &buffer) < 0 || !buffer) fail("read attribute", file, name);
    text = buffer;
    H5free_memory(buffer);
    return text;
  }
  text.resize(H5Tget_size(type));
  if (text.size() > (std::size_t{1} << 28) || H5Aread(attribute, type, text.data()) < 0)
    fail("read attribute", file, name);
  return text.substr(0, text.find('\0'));
}

template <class T>
void put_dataset(hid_t file, const std::string& file_name, const std::string& path, const Shape& shape,
                 const std::vector<T>& data, hid_t type, const std::string& units) {
  if (data.size() != product(shape))
    throw Error(Exit::internal, file_name + ":" + path + ": " + std::to_string(data.size()) +
                                    " values for a shape of " + std::to_string(product(shape)) +
                                    " (writer and data disagree)");
  const Handle links(H5Pcreate(H5P_LINK_CREATE), H5Pclose);
  H5Pset_create_intermediate_group(links, 1);
  const auto dims = dimensions(shape);
  const Handle space(H5Screate_simple(static_cast<int>(dims.size()), dims.data(), nullptr), H5Sclose);
  const Handle set(H5Dcreate2(file, path.c_str(), type, space, links, H5P_DEFAULT, H5P_DEFAULT), H5Dclose);
  if (!set.good()) fail("create", file_name, path);
  if (!data.empty() && H5Dwrite(set, type, H5S_ALL, H5S_ALL, H5P_DEFAULT, data_of(data)) < 0)
    fail("write", file_name, path);
  put_text(set, "units", units, file_name);
}

Handle open_dataset(hid_t file, const std::string& file_name, const std::string& path) {
  const hid_t set = H5Dopen2(file, path.c_str(), H5P_DEFAULT);
  if (set < 0)
    bad_content(file_name, path,
                "the dataset is missing (every file of this format has it) is the file complete?");
  return {set, H5Dclose};
}

Shape shape_of(hid_t set) {
  const Handle space(H5Dget_space(set), H5Sclose);
  const int rank = H5Sget_simple_extent_ndims(space);
  std::vector<hsize_t> dims(static_cast<std::size_t>(std::max(rank, 0)));
  if (rank > 0) H5Sget_simple_extent_dims(space, dims.data(), nullptr);
  return {dims.begin(), dims.end()};
}

template <class T>
std::vector<T> get_dataset(hid_t file, const std::string& file_name, const std::string& path, hid_t type) {
  const Handle set = open_dataset(file, file_name, path);
  const Handle stored(H5Dget_type(set), H5Tclose);
  const H5T_class_t kind = H5Tget_class(stored);
  if (kind != H5T_FLOAT && kind != H5T_INTEGER)
    bad_content(file_name, path, "the dataset holds no numbers (numbers are expected) rewrite the file");
  const std::size_t n = product(shape_of(set));
  // A damaged header can claim any size: believe only what the file can hold.
  std::error_code error;
  const auto bytes = std::filesystem::file_size(file_name, error);
  const Handle layout(H5Dget_create_plist(set), H5Pclose);
  const bool plain = H5Pget_layout(layout) != H5D_CHUNKED;
  if (!error && n > 0 && ((plain && n > bytes) || n > (std::size_t{1} << 36)))
    bad_content(file_name, path,
                "the dataset claims " + std::to_string(n) + " values (the file has " + std::to_string(bytes) +
                    " bytes) is the file damaged?");
  std::vector<T> data(n);
  if (n > 0 && H5Dread(set, type, H5S_ALL, H5S_ALL, H5P_DEFAULT, data.data()) < 0)
    fail("read", file_name, path);
  return data;
}

std::vector<std::string> children(hid_t file, const std::string& group, H5O_type_t wanted) {
  struct Found {
    H5O_type_t wanted;
    std::vector<std::string> names;
  } found{wanted, {}};
  const Handle id(H5Gopen2(file, group.c_str(), H5P_DEFAULT), H5Gclose);
  if (!id.good()) return {};
  H5Literate(
      id, H5_INDEX_NAME, H5_ITER_INC, nullptr,
      [](hid_t here, const char* name, const H5L_info_t*, void* out) -> herr_t {
        auto& f = *static_cast<Found*>(out);
        H5O_info_t info;
        if (H5Oget_info_by_name(here, name, &info, H5P_DEFAULT) >= 0 && info.type == f.wanted)
          f.names.emplace_back(name);
        return 0;
      },
      &found);
  return found.names;
}

}  // namespace

File File::create(const std::string& path) {
  silence();
  // The format of HDF5 1.8: attributes above 64 kB (a scene with many cells placed one by one) need it.
  const Handle access(H5Pcreate(H5P_FILE_ACCESS), H5Pclose);
  H5Pset_libver_bounds(access, H5F_LIBVER_V18, H5F_LIBVER_LATEST);
  const hid_t id = H5Fcreate(path.c_str(), H5F_ACC_TRUNC, H5P_DEFAULT, access);
  if (id < 0) fail("create", path, "/");
  return {id, path};
}

File File::open(const std::string& path) {
  silence();
  std::error_code error;
  require(std::filesystem::exists(path, error),
          [&] { return path + ": no such file (it was to be read) check the name"; });
  require(!std::filesystem::is_directory(path, error),
          [&] { return path + ": a folder (a file is expected) name the file inside"; });
  const hid_t id = H5Fopen(path.c_str(), H5F_ACC_RDONLY, H5P_DEFAULT);
  require(id >= 0,
          [&] { return path + ": not an HDF5 file, or damaged (" + reason() + ") is it the right file?"; });
  return {id, path};
}

File::File(File&& other) noexcept : id_(std::exchange(other.id_, -1)), path_(std::move(other.path_)) {}
File& File::operator=(File&& other) noexcept {
  std::swap(id_, other.id_);
  std::swap(path_, other.path_);
  return *this;
}
File::~File() {
  if (id_ >= 0) H5Fclose(id_);
}

void File::close() {
  const bool flushed = H5Fflush(id_, H5F_SCOPE_GLOBAL) >= 0;
  const bool closed = H5Fclose(std::exchange(id_, -1)) >= 0;
  if (!flushed || !closed) fail("close", path_, "/");
}

void File::write(const std::string& path, const Shape& shape, const std::vector<double>& data,
                 const std::string& units) {
  put_dataset(id_, path_, path, shape, data, H5T_NATIVE_DOUBLE, units);
}
void File::write(const std::string& path, const Shape& shape, const std::vector<std::int64_t>& data,
                 const std::string& units) {
  put_dataset(id_, path_, path, shape, data, H5T_NATIVE_INT64, units);
}

bool File::has(const std::string& path) const {
  // H5Lexists wants every step of the path to exist.
  for (std::size_t slash = path.find('/', 1);; slash = path.find('/', slash + 1)) {
    if (H5Lexists(id_, path.substr(0, slash).c_str(), H5P_DEFAULT) <= 0) return false;
    if (slash == std::string::npos) return true;
  }
}
std::vector<std::string> File::groups(const std::string& group) const {
  return children(id_, group, H5O_TYPE_GROUP);
}
std::vector<std::string> File::datasets(const std::string& group) const {
  return children(id_, group, H5O_TYPE_DATASET);
}
Shape File::shape(const std::string& path) const { return shape_of(open_dataset(id_, path_, path)); }
std::string File::units(const std::string& path) const {
  return get_text(open_dataset(id_, path_, path), "units", path_ + ":" + path);
}
std::vector<double> File::read(const std::string& path) const {
  return get_dataset<double>(id_, path_, path, H5T_NATIVE_DOUBLE);
}
std::vector<std::int64_t> File::read_integers(const std::string& path) const {
  return get_dataset<std::int64_t>(id_, path_, path, H5T_NATIVE_INT64);
}

void File::write_attribute(const std::string& name, const std::string& text) {
  put_text(id_, name, text, path_);
}
void File::write_attribute(const std::string& name, double value) {
  write_attribute(name, std::vector<double>{value});
}
void File::write_attribute(const std::string& name, std::uint64_t value) {
  const Handle space(H5Screate(H5S_SCALAR), H5Sclose);
  const Handle attribute(H5Acreate2(id_, name.c_str(), H5T_NATIVE_UINT64, space, H5P_DEFAULT, H5P_DEFAULT),
                         H5Aclose);
  if (!attribute.good() || H5Awrite(attribute, H5T_NATIVE_UINT64, &value) < 0)
    fail("write attribute", path_, name);
}
void File::write_attribute(const std::string& name, const std::vector<double>& values) {
  const hsize_t n = values.size();
  const Handle space(n == 1 ? H5Screate(H5S_SCALAR) : H5Screate_simple(1, &n, nullptr), H5Sclose);
  const Handle attribute(H5Acreate2(id_, name.c_str(), H5T_NATIVE_DOUBLE, space, H5P_DEFAULT, H5P_DEFAULT),
                         H5Aclose);
  if (!attribute.good() || H5Awrite(attribute, H5T_NATIVE_DOUBLE, data_of(values)) < 0)
    fail("write attribute", path_, name);
}
bool File::has_attribute(const std::string& name) const { return H5Aexists(id_, name.c_str()) > 0; }
std::string File::text_attribute(const std::string& name) const { return get_text(id_, name, path_); }
std::vector<double> File::attribute(const std::string& name) const {
  const Handle attribute(H5Aopen(id_, name.c_str(), H5P_DEFAULT), H5Aclose);
  if (!attribute.good())
    bad_content(path_, name,
                "the attribute is missing (every file of this format has it) is the file complete?");
  const Handle space(H5Aget_space(attribute), H5Sclose), type(H5Aget_type(attribute), H5Tclose);
  const H5T_class_t kind = H5Tget_class(type);
  const hssize_t n = H5Sget_simple_extent_npoints(space);
  if ((kind != H5T_FLOAT && kind != H5T_INTEGER) || n < 0 || n > 1000)
    bad_content(path_, name, "the attribute holds no few numbers (numbers are expected) rewrite the file");
  std::vector<double> values(static_cast<std::size_t>(n));
  if (n > 0 && H5Aread(attribute, H5T_NATIVE_DOUBLE, values.data()) < 0) fail("read attribute", path_, name);
  return values;
}
std::uint64_t File::integer_attribute(const std::string& name) const {
  const Handle attribute(H5Aopen(id_, name.c_str(), H5P_DEFAULT), H5Aclose);
  if (!attribute.good())
    bad_content(path_, name,
                "the attribute is missing (every file of this format has it) is the file complete?");
  const Handle space(H5Aget_space(attribute), H5Sclose), type(H5Aget_type(attribute), H5Tclose);
  std::uint64_t value = 0;
  if (H5Tget_class(type) != H5T_INTEGER || H5Sget_simple_extent_npoints(space) != 1 ||
      H5Aread(attribute, H5T_NATIVE_UINT64, &value) < 0)
    bad_content(path_, name,
                "the attribute is not one whole number (a whole number is expected) rewrite the file");
  return value;
}

}  // namespace hemowalk::hdf5
