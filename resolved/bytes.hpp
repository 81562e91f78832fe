#pragma once
/// \file Arrays in a stream of bytes, each with its length before it: parts of a checkpoint.

#include <cstdint>
#include <cstring>
#include <vector>

#include "core/check.hpp"
#include "core/view.hpp"

namespace hemowalk::resolved {

template <class T>
void put(std::vector<std::byte>& out, const T* data, std::size_t n) {
  const std::uint64_t count = n;
  const std::size_t at = out.size();
  out.resize(at + sizeof(count) + n * sizeof(T));
  std::memcpy(out.data() + at, &count, sizeof(count));
  if (n) std::memcpy(out.data() + at + sizeof(count), data, n * sizeof(T));
}

/// Takes arrays in the order in which they were put. \throws InputError when they are not there.
class Reader {
 public:
  explicit Reader(View<const std::byte> in) : in_(in) {}
  bool at_end() const { return at_ == in_.size; }
  template <class T>
  std::vector<T> take() {
    std::uint64_t n = 0;
    copy(&n, sizeof(n));
    require(n <= in_.size / sizeof(T),
            "the checkpoint is damaged (a length runs past its end) start from an older one");
    std::vector<T> v(n);
    copy(v.data(), n * sizeof(T));
    return v;
  }
  template <class T>
  void into(T* data, std::size_t n) {
    const auto v = take<T>();
    require(
        v.size() == n,
        "the checkpoint does not fit the scene (an array has another length) use the scene it was made with");
    if (n) std::memcpy(static_cast<void*>(data), v.data(), n * sizeof(T));
  }

 private:
  void copy(void* to, std::size_t bytes) {
    require(bytes <= in_.size - at_, "the checkpoint is damaged (it ends too early) start from an older one");
    if (bytes) std::memcpy(to, in_.data + at_, bytes);
    at_ += bytes;
  }
  View<const std::byte> in_;
  std::size_t at_ = 0;
};

}  // namespace hemowalk::resolved
