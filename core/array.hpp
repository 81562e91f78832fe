#pragma once
/// \file Array: the owner of memory at a Place. Copies between places are by name, never by accident.

#include <algorithm>
#include <cstdlib>
#include <cstring>
#include <new>
#include <string>
#include <type_traits>
#include <utility>

#include "core/check.hpp"
#include "core/device_choice.hpp"
#include "core/portability.hpp"
#include "core/view.hpp"
#if defined(HEMOWALK_CUDA)
#include <cuda_runtime_api.h>
#endif
#if defined(__linux__)
#include <sys/mman.h>
#endif

namespace hemowalk {

#if defined(HEMOWALK_CUDA)
namespace detail {
inline void check(cudaError_t status, const char* what) {
  if (status == cudaSuccess) return;
  throw Error(Exit::internal, std::string(what) + " failed on the device (" + cudaGetErrorString(status) +
                                  ") see whether the GPU has memory left, or use place: host");
}
}  // namespace detail
#endif

/// Owner of \p size trivially copyable elements, 64-byte aligned, zero-filled (in parallel: first touch).
template <class T>
class Array {
  static_assert(std::is_trivially_copyable_v<T>);

 public:
  Array() = default;
  explicit Array(std::size_t size, Place place = Place::host) : size_(size), place_(place) {
    if (size_ == 0) return;
    // Large arrays lie on huge pages where the system grants them: 10-20 % more bandwidth.
    const std::size_t huge = std::size_t{2} << 20, bytes_needed = size_ * sizeof(T);
    const std::size_t alignment = place_ == Place::host && bytes_needed >= 2 * huge ? huge : 64;
    const std::size_t bytes = (bytes_needed + alignment - 1) / alignment * alignment;
    if (place_ == Place::host) {
      data_ = static_cast<T*>(std::aligned_alloc(alignment, bytes));
      if (!data_) throw std::bad_alloc();
#if defined(__linux__) && defined(MADV_HUGEPAGE)
      if (alignment == huge) (void)madvise(data_, bytes, MADV_HUGEPAGE);
#endif
      auto* raw = reinterpret_cast<unsigned char*>(data_);
      const std::ptrdiff_t page = 1 << 16, pages = (static_cast<std::ptrdiff_t>(bytes) + page - 1) / page;
#pragma omp parallel for schedule(static)
      for (std::ptrdiff_t p = 0; p < pages; ++p)
        std::memset(raw + p * page, 0, std::min<std::size_t>(page, bytes - p * page));
    } else {
#if defined(HEMOWALK_CUDA)
      if (!use_device() || cudaMalloc(reinterpret_cast<void**>(&data_), bytes) != cudaSuccess)
        throw std::bad_alloc();
      const cudaError_t cleared = cudaMemset(data_, 0, bytes);
      const cudaError_t done = cudaStreamSynchronize(nullptr);  // a Queue's stream does not wait for it
      if (cleared != cudaSuccess || done != cudaSuccess) {
        cudaFree(data_);  // no destructor runs
        detail::check(cleared, "clearing memory"), detail::check(done, "clearing memory");
      }
#else
      throw std::bad_alloc();  // built without CUDA: there is no device
#endif
    }
  }
  Array(Array&& o) noexcept { swap(o); }
  Array& operator=(Array&& o) noexcept {
    swap(o);
    return *this;
  }
  Array(const Array&) = delete;
  Array& operator=(const Array&) = delete;
  ~Array() {
    if (!data_) return;
    if (place_ == Place::host) {
      std::free(data_);
    } else {
#if defined(HEMOWALK_CUDA)
      cudaFree(data_);
#endif
    }
  }

  std::size_t size() const { return size_; }
  Place place() const { return place_; }
  T* data() { return data_; }
  const T* data() const { return data_; }
  T& operator[](std::size_t i) { return data_[i]; }
  const T& operator[](std::size_t i) const { return data_[i]; }
  T* begin() { return data_; }
  T* end() { return data_ + size_; }
  const T* begin() const { return data_; }
  const T* end() const { return data_ + size_; }
  View<T> view() { return {data_, size_}; }
  View<const T> view() const { return {data_, size_}; }

  void swap(Array& o) noexcept {
    std::swap(data_, o.data_);
    std::swap(size_, o.size_);
    std::swap(place_, o.place_);
  }

 private:
  T* data_ = nullptr;
  std::size_t size_ = 0;
  Place place_ = Place::host;
};

/// A copy of \p source at \p place, there when the call returns: the streams of Queues do not wait for
/// others.
template <class T>
Array<T> place_copy(Place place, const Array<T>& source) {
  Array<T> result(source.size(), place);
  if (source.size() == 0) return result;
#if defined(HEMOWALK_CUDA)
  if (place == Place::device || source.place() == Place::device) {
    detail::check(cudaMemcpy(result.data(), source.data(), source.size() * sizeof(T), cudaMemcpyDefault),
                  "a copy");
    // Not the whole device: another thread may be recording there.
    detail::check(cudaStreamSynchronize(nullptr), "a copy");
    return result;
  }
#endif
  std::memcpy(static_cast<void*>(result.data()), source.data(), source.size() * sizeof(T));
  return result;
}

}  // namespace hemowalk
