#pragma once
#include <memory>
#include <vector>

#include "backends/backend.h"
#include "backends/worker/worker.h"

namespace reliefbench {

// Devices in worker processes. Whatever a driver does there (it crashes, hangs, takes all memory) ends a call with an
// Error, after which Backend::is_gone() holds; the next device is opened in a new worker. What is timed, a batch or a
// compute job, is one call, so that no message falls into its time but a job's signs of life, one a second at most.

/// throws: as BackendRow::open(), and as Worker::call()
[[nodiscard]] std::unique_ptr<Backend> open_remote(std::unique_ptr<Worker> worker, const BackendRow& row,
                                                   int device_index, const BackendOptions& options);

/// Set to anything but "" or "0": drivers run in this process after all, for debuggers and profilers.
inline constexpr const char* kInProcess = "RELIEFBENCH_IN_PROCESS";
/// MiB that a worker may take of private memory (RLIMIT_DATA); unset: what the system gives.
inline constexpr const char* kWorkerMemory = "RELIEFBENCH_WORKER_MEMORY_MB";

/// A device that is real in a worker of its own; any in this process where kInProcess says so. Its pipelines are kept.
/// throws: as open_remote()
[[nodiscard]] std::unique_ptr<Backend> open_isolated(const BackendRow& row, int device_index);
/// The same without BackendOptions::keeps_pipelines, for times of compilation.
[[nodiscard]] std::unique_ptr<Backend> open_isolated_uncached(const BackendRow& row, int device_index);
/// Its devices, as a worker sees them. Where a driver crashes over the question twice, that is told on stderr, and
/// there are none.
[[nodiscard]] std::vector<DeviceInfo> isolated_devices(const BackendRow& row);

}  // namespace reliefbench
