#pragma once
/// \file Which device a process uses: one, the same for all of its host threads.

#include <algorithm>
#include <cstdlib>

#if defined(HEMOWALK_CUDA)
#include <cuda_runtime_api.h>
#endif

namespace hemowalk {

/// First device of the run that this process belongs to: 0, or what the launcher of several runs gave it.
inline int first_device_of_run() {
  const char* value = std::getenv("HEMOWALK_DEVICE");
  return value ? std::max(0, std::atoi(value)) : 0;
}

/// Which of \p count devices this process takes: the ranks of a run on one machine take turns, from the run's
/// first device on. Their numbers on the machine are the launcher's: Open MPI's, or Slurm's.
inline int device_of_process(int count) {
  int rank = 0;
  for (const char* name : {"SLURM_LOCALID", "OMPI_COMM_WORLD_LOCAL_RANK"})
    if (const char* value = std::getenv(name)) rank = std::atoi(value);
  return (first_device_of_run() + rank) % count;
}

/// The calling host thread's work goes to this process's device from now on: the current device belongs to a
/// thread, and is the first one unless it is told. \returns false when that is not to be had.
inline bool use_device() {
#if defined(HEMOWALK_CUDA)
  thread_local bool chosen = false;
  int count = 0;
  if (!chosen)
    chosen = cudaGetDeviceCount(&count) == cudaSuccess && count > 0 &&
             cudaSetDevice(device_of_process(count)) == cudaSuccess;
  return chosen;
#else
  return false;
#endif
}

}  // namespace hemowalk
