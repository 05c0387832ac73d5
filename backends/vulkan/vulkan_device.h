#pragma once
#include <volk.h>

#include <array>
#include <cstdint>
#include <limits>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "backends/backend.h"
#include "backends/pipeline_cache.h"
#include "kernels/base/error.h"

// Vulkan's structures are meant to be zero beyond the members that are named.
#pragma GCC diagnostic ignored "-Wmissing-field-initializers"

namespace reliefbench {

/// What a result code says has failed.
[[nodiscard]] Fault fault_of(VkResult result);
/// throws: Error(environment) "vulkan: <call> failed: <result in words>", for every result but VK_SUCCESS
void vk_check(VkResult result, std::string_view call);

/// Extensions of an instance that a window's system asks for; none without a window.
using WindowExtensions = std::span<const char* const>;

/// Vulkan 1.2. With debug, the Khronos validation layer with synchronization checks.
class VulkanInstance {
 public:
  /// throws: Error(environment): no loader, no driver, no Vulkan 1.2; with debug: no validation layer
  explicit VulkanInstance(bool debug, WindowExtensions window = {});
  ~VulkanInstance();
  VulkanInstance(const VulkanInstance&) = delete;
  VulkanInstance& operator=(const VulkanInstance&) = delete;

  [[nodiscard]] VkInstance handle() const { return handle_; }
  /// Warnings and errors of the validation layer. They go to stderr too: leaks are found when it is too late to ask.
  [[nodiscard]] const std::vector<std::string>& messages() const { return messages_; }
  /// Null without debug. Loaded here because volk's own pointers are those of the last instance made.
  [[nodiscard]] PFN_vkSetDebugUtilsObjectNameEXT set_object_name() const { return set_object_name_; }

 private:
  void start_messenger(const VkDebugUtilsMessengerCreateInfoEXT& info);

  std::vector<std::string> messages_;
  VkInstance handle_ = VK_NULL_HANDLE;
  VkDebugUtilsMessengerEXT messenger_ = VK_NULL_HANDLE;
  PFN_vkDestroyDebugUtilsMessengerEXT destroy_messenger_ = nullptr;
  PFN_vkSetDebugUtilsObjectNameEXT set_object_name_ = nullptr;
};

/// A device with Vulkan 1.2 and a queue that draws and computes.
struct PhysicalDevice {
  VkPhysicalDevice handle;
  VkPhysicalDeviceProperties properties;
  std::uint32_t queue_family;
  std::uint32_t timestamp_bits;  ///< 0: no timestamps
  VkDeviceSize most_memory;      ///< maxMemoryAllocationSize
  VkPhysicalDeviceFeatures features;
};
/// The feature that a device's textures of a type need.
struct BlockFeature {
  TexelType type;
  VkBool32 VkPhysicalDeviceFeatures::*feature;
  std::string_view id;
};
inline constexpr std::array<BlockFeature, 4> kBlockFeatures{{
    {TexelType::rgtc, &VkPhysicalDeviceFeatures::textureCompressionBC, "textureCompressionBC"},
    {TexelType::eac, &VkPhysicalDeviceFeatures::textureCompressionETC2, "textureCompressionETC2"},
    {TexelType::bc7, &VkPhysicalDeviceFeatures::textureCompressionBC, "textureCompressionBC"},
    {TexelType::astc, &VkPhysicalDeviceFeatures::textureCompressionASTC_LDR, "textureCompressionASTC_LDR"},
}};
/// In the loader's order; DeviceInfo::index counts these.
[[nodiscard]] std::vector<PhysicalDevice> physical_devices(const VulkanInstance& instance);
[[nodiscard]] DeviceInfo device_info(const PhysicalDevice& physical, int index);

/// VkDevice and its own function pointers, so that two open devices do not disturb each other.
class LogicalDevice {
 public:
  /// presents: into windows
  LogicalDevice(const PhysicalDevice& physical, bool presents);
  ~LogicalDevice();
  LogicalDevice(const LogicalDevice&) = delete;
  LogicalDevice& operator=(const LogicalDevice&) = delete;

  [[nodiscard]] VkDevice handle() const { return handle_; }
  [[nodiscard]] const VolkDeviceTable& calls() const { return calls_; }

 private:
  VkDevice handle_ = VK_NULL_HANDLE;
  VolkDeviceTable calls_{};
};

/// Owner of one Vulkan object; Destroy is the VolkDeviceTable member that ends it.
template <typename Handle, auto Destroy>
class Owned {
 public:
  Owned() = default;
  Owned(const LogicalDevice& device, Handle handle) : device_(&device), handle_(handle) {}
  Owned(Owned&& other) noexcept : device_(other.device_), handle_(std::exchange(other.handle_, VK_NULL_HANDLE)) {}
  Owned& operator=(Owned&& other) noexcept {
    std::swap(device_, other.device_);
    std::swap(handle_, other.handle_);
    return *this;
  }
  Owned(const Owned&) = delete;
  Owned& operator=(const Owned&) = delete;
  ~Owned() {
    if (handle_ != VK_NULL_HANDLE) (device_->calls().*Destroy)(device_->handle(), handle_, nullptr);
  }
  [[nodiscard]] Handle get() const { return handle_; }

 private:
  const LogicalDevice* device_ = nullptr;
  Handle handle_ = VK_NULL_HANDLE;
};

/// What everything else needs: one device, one queue, and a way to run commands to their end.
class VulkanDevice {
 public:
  /// throws: Error(environment): no device with this index
  VulkanDevice(int index, const BackendOptions& options, WindowExtensions window = {});

  [[nodiscard]] const VulkanInstance& instance() const { return instance_; }
  [[nodiscard]] const PhysicalDevice& physical() const { return physical_; }
  [[nodiscard]] const LogicalDevice& logical() const { return logical_; }
  [[nodiscard]] VkDevice handle() const { return logical_.handle(); }
  [[nodiscard]] const VolkDeviceTable& calls() const { return logical_.calls(); }
  [[nodiscard]] VkQueue queue() const { return queue_; }
  [[nodiscard]] VkCommandPool command_pool() const { return command_pool_.get(); }
  [[nodiscard]] const PipelineCache& pipelines() const { return pipelines_; }

  /// Submits in this order and waits for the fence; returns nanoseconds of the host's clock from submit to fence.
  double run(std::span<const VkCommandBuffer> commands) const;

 private:
  VulkanInstance instance_;
  PhysicalDevice physical_;
  LogicalDevice logical_;
  PipelineCache pipelines_;
  VkQueue queue_ = VK_NULL_HANDLE;
  Owned<VkCommandPool, &VolkDeviceTable::vkDestroyCommandPool> command_pool_;
  Owned<VkFence, &VolkDeviceTable::vkDestroyFence> fence_;
};

/// A command buffer, recording from its construction until end().
class Commands {
 public:
  Commands(const VulkanDevice& device, VkCommandBufferUsageFlags usage);
  ~Commands();
  Commands(const Commands&) = delete;
  Commands& operator=(const Commands&) = delete;

  [[nodiscard]] VkCommandBuffer handle() const { return handle_; }
  VkCommandBuffer end() const;

 private:
  const VulkanDevice& device_;
  VkCommandBuffer handle_ = VK_NULL_HANDLE;
};

/// Records `record(VkCommandBuffer)` and runs it to its end.
template <typename Record>
void run_once(const VulkanDevice& device, Record record) {
  const Commands commands(device, VK_COMMAND_BUFFER_USAGE_ONE_TIME_SUBMIT_BIT);
  record(commands.handle());
  const VkCommandBuffer recorded = commands.end();
  device.run({&recorded, 1});
}

}  // namespace reliefbench
