#pragma once
#include <memory>

#include "backends/vulkan/vulkan_device.h"
#include "backends/vulkan/vulkan_memory.h"

namespace reliefbench {

// What a window needs of the backend beside its interface.

/// The backend of a device that presents into windows.
/// throws: Error(environment): no such device, or it presents nothing
[[nodiscard]] std::unique_ptr<Backend> open_vulkan_for_window(int device_index, const BackendOptions& options,
                                                              WindowExtensions window);

/// backend: of open_vulkan_for_window()
[[nodiscard]] const VulkanDevice& vulkan_device_of(const Backend& backend);

/// The last frame drawn into Target::color. throws: Error(environment): none was
[[nodiscard]] const DeviceImage& image_in_window(const Backend& backend);

}  // namespace reliefbench
