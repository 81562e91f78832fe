#pragma once
/// \file Kernels: the same functor on a GPU or, thread by thread, on the host.
///
/// A kernel is a named, trivially copyable functor of Views and scalars, of one of two kinds:
///  - a loop body, `HEMO_HD void operator()(std::size_t i) const`: queue.for_each(n, body);
///  - a block body, whose threads work together through shared memory:
///        static constexpr int threads = 128;        // per block
///        HEMO_HD int phases() const;                // the same for all threads
///        HEMO_HD void operator()(int phase, BlockThread at, unsigned char* shared) const;
///    queue.blocks(n, shared_bytes, body). All threads of a block finish a phase before any starts the next
///    (on the device: __syncthreads() in between), so a functor never waits by itself and the host can run it
///    as plain loops. What one phase writes and another thread reads must be in different phases.
///
/// So tests on a machine without a GPU run every kernel body. Two threads that meet within a phase would give
/// a result that depends on their order: HostThreads turns the order round, and tests compare bits.
///
/// A Queue records work as a Graph (a CUDA graph; on the host a list of functors, copied by value as the
/// device does) and replays it. Files that call for_each() or blocks() belong under KERNELS in CMakeLists.

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include <omp.h>

#include "core/array.hpp"
#include "core/check.hpp"
#include "core/device_choice.hpp"
#include "core/portability.hpp"

#if defined(HEMOWALK_CUDA)
#include <cuda_runtime_api.h>
#endif

namespace hemowalk {

/// Who a thread of a block body is.
struct BlockThread {
  unsigned block, thread;
};

/// *at += value; \returns what was there. Integers only: sums of floating-point numbers would depend on the
/// order.
HEMO_HD inline unsigned atomic_add(unsigned* at, unsigned value) {
#if defined(__CUDA_ARCH__)
  return atomicAdd(at, value);
#else
  return __atomic_fetch_add(at, value, __ATOMIC_RELAXED);
#endif
}
HEMO_HD inline void atomic_add(std::int64_t* at, std::int64_t value) {
#if defined(__CUDA_ARCH__)
  // Two's complement: unsigned addition is signed addition.
  atomicAdd(reinterpret_cast<unsigned long long*>(at), static_cast<unsigned long long>(value));
#else
  __atomic_fetch_add(at, value, __ATOMIC_RELAXED);
#endif
}
/// *at = min(*at, value).
HEMO_HD inline void atomic_min(int* at, int value) {
#if defined(__CUDA_ARCH__)
  atomicMin(at, value);
#else
  int seen = __atomic_load_n(at, __ATOMIC_RELAXED);
  while (value < seen &&
         !__atomic_compare_exchange_n(at, &seen, value, true, __ATOMIC_RELAXED, __ATOMIC_RELAXED)) {
  }
#endif
}

/// The order in which the host runs the threads of a block, for tests; blocks run in turn, but for forward
/// from the last to the first.
enum class HostThreads { forward, backward, scattered };
inline HostThreads& host_threads() {
  static HostThreads order = HostThreads::forward;
  return order;
}

namespace detail {

inline constexpr const char* wrong_compiler =
    "a kernel cannot be launched from here (this file was not compiled for the device) list it under KERNELS";

inline unsigned host_thread(unsigned i, unsigned count, HostThreads order) {
  if (order == HostThreads::forward) return i;
  if (order == HostThreads::backward) return count - 1 - i;
  return static_cast<unsigned>(i * std::uint64_t{7919} % count);  // 7919 is prime: a permutation
}

template <class Body>
void run_blocks(unsigned blocks, std::size_t shared_bytes, const Body& body) {
  const HostThreads order = host_threads();
  const auto count = static_cast<unsigned>(Body::threads);
  static_assert(Body::threads % 7919 != 0);
#pragma omp parallel
  {
    struct alignas(64) Line {
      unsigned char byte[64];
    };
    std::vector<Line> lines(shared_bytes / 64 + 1);
    unsigned char* shared = lines[0].byte;
#pragma omp for schedule(static)
    for (unsigned b = 0; b < blocks; ++b) {
      const unsigned block = order == HostThreads::forward ? b : blocks - 1 - b;
      // Shared memory holds rubbish at the start, as on the device: NaN in every precision.
      if (order != HostThreads::forward) std::memset(static_cast<void*>(shared), 0xff, lines.size() * 64);
      const int phases = body.phases();
      for (int phase = 0; phase < phases; ++phase)
        for (unsigned i = 0; i < count; ++i) body(phase, {block, host_thread(i, count, order)}, shared);
    }
  }
}

template <class Body>
void run_each(std::size_t n, const Body& body) {
  const bool forward = host_threads() == HostThreads::forward;
#pragma omp parallel for schedule(static)
  for (std::ptrdiff_t i = 0; i < static_cast<std::ptrdiff_t>(n); ++i)
    body(static_cast<std::size_t>(forward ? i : static_cast<std::ptrdiff_t>(n) - 1 - i));
}

#if defined(__CUDACC__)
template <class Body>
__global__ void __launch_bounds__(256) each_kernel(std::size_t n, Body body) {
  const std::size_t i = blockIdx.x * static_cast<std::size_t>(blockDim.x) + threadIdx.x;
  if (i < n) body(i);
}
template <class Body>
__global__ void __launch_bounds__(Body::threads) block_kernel(Body body) {
  extern __shared__ __align__(32) unsigned char shared[];  // 32: Node4<double>
  const BlockThread at{blockIdx.x, threadIdx.x};
  const int phases = body.phases();
  for (int phase = 0; phase < phases; ++phase) {
    if (phase > 0) __syncthreads();
    body(phase, at, shared);
  }
}
#endif

}  // namespace detail

inline constexpr const char* no_device =
    "place: device asked for (no GPU is visible, or this program was built without CUDA) configure with "
    "-D HEMOWALK_CUDA=ON on a machine with a GPU, or use place: host";

/// Is there a GPU this process may use?
inline bool device_present() {
#if defined(HEMOWALK_CUDA)
  int count = 0;
  return cudaGetDeviceCount(&count) == cudaSuccess && count > 0;
#else
  return false;
#endif
}

/// Memory of the host that a device's copies may read and write while the host goes on, for as long as this
/// lives.
class Pinned {
 public:
  Pinned([[maybe_unused]] Place place, [[maybe_unused]] const void* data,
         [[maybe_unused]] std::size_t bytes) {
#if defined(HEMOWALK_CUDA)
    if (place == Place::host || bytes == 0 || !use_device()) return;
    if (cudaHostRegister(const_cast<void*>(data), bytes, cudaHostRegisterDefault) == cudaSuccess)
      data_ = data;
    else
      (void)cudaGetLastError();  // copies then wait for each other, that is all
#endif
  }
  Pinned(Pinned&& o) noexcept : data_(std::exchange(o.data_, nullptr)) {}
  Pinned& operator=(Pinned&&) = delete;
  ~Pinned() {
#if defined(HEMOWALK_CUDA)
    if (data_) cudaHostUnregister(const_cast<void*>(data_));
#endif
  }

 private:
  const void* data_ = nullptr;
};

/// An array of the host, pinned as one for \p place: anew only where it grows.
template <class T>
class PinnedArray {
 public:
  explicit PinnedArray(Place place, std::size_t size = 0) : place_(place) { fit(size); }
  /// As Queue::fit; no copy may be under way.
  void fit(std::size_t n) {
    if (n <= array_.size()) return;
    Array<T> larger(array_.size() == 0 ? n : n + n / 4);
    std::copy(array_.begin(), array_.end(), larger.begin());
    pin_.reset();  // before memory goes
    array_ = std::move(larger);
    pin_.emplace(place_, array_.data(), array_.size() * sizeof(T));
  }
  std::size_t size() const { return array_.size(); }
  T* data() { return array_.data(); }
  const T* data() const { return array_.data(); }
  T& operator[](std::size_t i) { return array_[i]; }
  const T& operator[](std::size_t i) const { return array_[i]; }
  View<T> view() { return array_.view(); }
  View<const T> view() const { return array_.view(); }

 private:
  Place place_;
  Array<T> array_;
  std::optional<Pinned> pin_;
};

/// Recorded work, to be replayed by Queue::replay with one launch.
class Graph {
 public:
  bool empty() const { return work_.empty() && !executable_; }
  /// Kernels (and copies) in it.
  std::size_t size() const { return size_; }

 private:
  friend class Queue;
  std::vector<std::function<void()>> work_;
  std::shared_ptr<void> executable_;
  std::size_t size_ = 0;
};

/// Work in order at one Place: a CUDA stream, or plain loops that are done when a call returns. Any host
/// thread may use it, one at a time.
class Queue {
 public:
  /// \throws InputError when a device is asked for and there is none.
  explicit Queue(Place place) : place_(place) {
    if (place == Place::host) return;
    require(device_present(), no_device);
#if defined(HEMOWALK_CUDA)
    enter();
    detail::check(cudaStreamCreateWithFlags(&stream_, cudaStreamNonBlocking), "creating a stream");
#endif
  }
  Queue(const Queue&) = delete;
  Queue& operator=(const Queue&) = delete;
  ~Queue() {
#if defined(HEMOWALK_CUDA)
    if (stream_) cudaStreamDestroy(stream_);
#endif
  }

  Place place() const { return place_; }

  /// \throws InputError where a block has less shared memory than \p bytes: known before work is recorded.
  /// The host has as much as the devices that have most.
  void require_shared_memory(std::size_t bytes) const {
    int most = 227 * 1024;
#if defined(HEMOWALK_CUDA)
    enter();
    if (place_ == Place::device) {
      int device = 0;
      detail::check(cudaGetDevice(&device), "asking for the device");
      detail::check(cudaDeviceGetAttribute(&most, cudaDevAttrMaxSharedMemoryPerBlockOptin, device),
                    "asking for its shared memory");
    }
#endif
    require(bytes <= static_cast<std::size_t>(most),
            "a cell does not fit into this device (its block of threads needs " + std::to_string(bytes) +
                " bytes of shared memory, there are " + std::to_string(most) +
                ") use fluid.precision: single, a lower subdivision, or place: host");
  }

  /// body(i) for i in [0, n), in any order.
  template <class Body>
  void for_each(std::size_t n, const Body& body) {
    static_assert(std::is_trivially_copyable_v<Body>, "bodies are copied into the kernel");
    if (n == 0) return;
    ++enqueued_;
    enter();
    if (place_ == Place::host) return run([n, body] { detail::run_each(n, body); });
#if defined(__CUDACC__)
    detail::each_kernel<<<static_cast<unsigned>((n + 255) / 256), 256, 0, stream_>>>(n, body);
    detail::check(cudaGetLastError(), "launching a kernel");
#else
    throw Error(Exit::internal, detail::wrong_compiler);
#endif
  }

  /// All phases of body for the threads of blocks 0 .. count-1, each with shared memory of its own.
  template <class Body>
  void blocks(std::size_t count, std::size_t shared_bytes, const Body& body) {
    static_assert(std::is_trivially_copyable_v<Body>, "bodies are copied into the kernel");
    if (count == 0) return;
    ++enqueued_;
    enter();
    const auto n = static_cast<unsigned>(count);
    if (place_ == Place::host)
      return run([n, shared_bytes, body] { detail::run_blocks(n, shared_bytes, body); });
#if defined(__CUDACC__)
    if (shared_bytes > 48 * 1024)
      detail::check(
          cudaFuncSetAttribute(detail::block_kernel<Body>, cudaFuncAttributeMaxDynamicSharedMemorySize,
                               static_cast<int>(shared_bytes)),
          "asking for more than 48 KiB of shared memory");
    detail::block_kernel<<<n, Body::threads, shared_bytes, stream_>>>(body);
    detail::check(cudaGetLastError(), "launching a kernel");
#else
    throw Error(Exit::internal, detail::wrong_compiler);
#endif
  }

  /// Copies \p n elements; either side may be on either place.
  template <class T>
  void copy(T* to, const T* from, std::size_t n) {
    static_assert(std::is_trivially_copyable_v<T>);
    if (n == 0) return;
    ++enqueued_;
    enter();
    if (place_ == Place::host) return run([=] { std::memcpy(static_cast<void*>(to), from, n * sizeof(T)); });
#if defined(HEMOWALK_CUDA)
    detail::check(cudaMemcpyAsync(to, from, n * sizeof(T), cudaMemcpyDefault, stream_), "a copy");
#endif
  }

  /// Makes room for \p n elements; what was there stays. The first size fits exactly, an array that grows
  /// gets room for more. Waits.
  template <class T>
  void fit(Array<T>& array, std::size_t n) {
    if (n <= array.size()) return;
    Array<T> larger(array.size() == 0 ? n : n + n / 4, place_);
    copy(larger.data(), array.data(), array.size());
    wait();
    array = std::move(larger);
  }
  /// The values of \p from at the start of \p to; waits.
  template <class T>
  void upload(Array<T>& to, const std::vector<T>& from) {
    copy(to.data(), from.data(), from.size());
    wait();
  }

  /// Returns when everything enqueued is done. \throws Error if any of it failed.
  void wait() {
    enter();
#if defined(HEMOWALK_CUDA)
    if (place_ == Place::device) detail::check(cudaStreamSynchronize(stream_), "a kernel");
#endif
  }

  /// What \p work enqueues is kept instead of done. When it throws, nothing is kept and the queue goes on.
  template <class Work>
  Graph record(const Work& work) {
    begin_recording();
    try {
      work();
    } catch (...) {
      recording_ = false;
      work_.clear();
#if defined(HEMOWALK_CUDA)
      if (place_ == Place::device) {
        cudaGraph_t dropped = nullptr;
        cudaStreamEndCapture(stream_, &dropped);
        if (dropped) cudaGraphDestroy(dropped);
        (void)cudaGetLastError();  // what went wrong is on its way up
      }
#endif
      throw;
    }
    return end_recording();
  }
  void replay(const Graph& graph) {
    enter();
    for (const auto& work : graph.work_) work();
#if defined(HEMOWALK_CUDA)
    if (graph.executable_)
      detail::check(cudaGraphLaunch(static_cast<cudaGraphExec_t>(graph.executable_.get()), stream_),
                    "launching a graph");
#endif
  }

  /// Seconds between two moments of this queue's work; for benchmarks.
  class Moment {
   public:
    /// Wall time on the host; on the device the time when the work enqueued so far was done.
    double seconds_since(const Moment& earlier) const {
#if defined(HEMOWALK_CUDA)
      if (event_) {
        float milliseconds = 0;
        auto *from = static_cast<cudaEvent_t>(earlier.event_.get()),
             *to = static_cast<cudaEvent_t>(event_.get());
        detail::check(cudaEventSynchronize(to), "a kernel");
        detail::check(cudaEventElapsedTime(&milliseconds, from, to), "timing");
        return 1e-3 * milliseconds;
      }
#endif
      return wall_ - earlier.wall_;
    }

   private:
    friend class Queue;
    double wall_ = 0;
    std::shared_ptr<void> event_;
  };
  Moment now() {
    enter();
    Moment moment;
    moment.wall_ = omp_get_wtime();
#if defined(HEMOWALK_CUDA)
    if (place_ == Place::device) {
      cudaEvent_t event = nullptr;
      detail::check(cudaEventCreate(&event), "timing");
      moment.event_ =
          std::shared_ptr<void>(event, [](void* e) { cudaEventDestroy(static_cast<cudaEvent_t>(e)); });
      detail::check(cudaEventRecord(event, stream_), "timing");
    }
#endif
    return moment;
  }

 private:
  void begin_recording() {
    enter();
    recording_ = true;
    enqueued_ = 0;
    work_.clear();
#if defined(HEMOWALK_CUDA)
    if (place_ == Place::device)
      detail::check(cudaStreamBeginCapture(stream_, cudaStreamCaptureModeThreadLocal), "recording a graph");
#endif
  }
  Graph end_recording() {
    Graph graph;
    graph.size_ = enqueued_;
    graph.work_ = std::move(work_);
    work_.clear();
    recording_ = false;
#if defined(HEMOWALK_CUDA)
    if (place_ == Place::device) {
      cudaGraph_t captured = nullptr;
      cudaGraphExec_t executable = nullptr;
      detail::check(cudaStreamEndCapture(stream_, &captured), "recording a graph");
      const cudaError_t built = cudaGraphInstantiate(&executable, captured, 0);
      cudaGraphDestroy(captured);
      detail::check(built, "building a graph");
      graph.executable_ = std::shared_ptr<void>(
          executable, [](void* e) { cudaGraphExecDestroy(static_cast<cudaGraphExec_t>(e)); });
    }
#endif
    return graph;
  }
  /// The calling thread's current device may be another one.
  void enter() const {
    if (place_ == Place::device) require(use_device(), no_device);
  }
  template <class Work>
  void run(Work&& work) {
    if (recording_)
      work_.emplace_back(std::forward<Work>(work));
    else
      work();
  }

  Place place_;
  bool recording_ = false;
  std::size_t enqueued_ = 0;
  std::vector<std::function<void()>> work_;
#if defined(HEMOWALK_CUDA)
  cudaStream_t stream_ = nullptr;
#endif
};

/// An array at \p place with the values of \p source.
template <class T>
Array<T> make_array(Place place, const std::vector<T>& source) {
  Array<T> host(source.size());
  if (!source.empty()) std::memcpy(static_cast<void*>(host.data()), source.data(), source.size() * sizeof(T));
  return place == Place::host ? std::move(host) : place_copy(place, host);
}

}  // namespace hemowalk
