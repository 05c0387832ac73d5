#include "backends/vulkan/vulkan_device.h"

#include <chrono>
#include <limits>
#include <optional>

#include "backends/vulkan/vulkan_pipeline_cache.h"
#include "kernels/base/error.h"

namespace reliefbench {
namespace {

std::string vendor_name(std::uint32_t vendor_id) {
  switch (vendor_id) {
    case 0x1002:
      return "AMD";
    case 0x1010:
      return "Imagination";
    case 0x106B:
      return "Apple";
    case 0x10DE:
      return "NVIDIA";
    case 0x13B5:
      return "Arm";
    case 0x5143:
      return "Qualcomm";
    case 0x8086:
      return "Intel";
    case VK_VENDOR_ID_MESA:
      return "Mesa";
    default:
      return fmt::format("PCI vendor {:#06x}", vendor_id);
  }
}

std::string_view type_name(VkPhysicalDeviceType type) {
  switch (type) {
    case VK_PHYSICAL_DEVICE_TYPE_CPU:
      return "cpu";
    case VK_PHYSICAL_DEVICE_TYPE_INTEGRATED_GPU:
      return "integrated";
    case VK_PHYSICAL_DEVICE_TYPE_DISCRETE_GPU:
      return "discrete";
    case VK_PHYSICAL_DEVICE_TYPE_VIRTUAL_GPU:
      return "virtual";
    default:
      return "other";
  }
}

/// Its PCI address; "" where the driver does not tell.
std::string pci_address(VkPhysicalDevice handle) {
  std::uint32_t count = 0;
  vkEnumerateDeviceExtensionProperties(handle, nullptr, &count, nullptr);
  std::vector<VkExtensionProperties> extensions(count);
  vkEnumerateDeviceExtensionProperties(handle, nullptr, &count, extensions.data());
  if (std::ranges::none_of(extensions, [](const VkExtensionProperties& one) {
        return std::string_view(one.extensionName) == VK_EXT_PCI_BUS_INFO_EXTENSION_NAME;
      }))
    return "";
  VkPhysicalDevicePCIBusInfoPropertiesEXT pci{.sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_PCI_BUS_INFO_PROPERTIES_EXT};
  VkPhysicalDeviceProperties2 query{.sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_PROPERTIES_2, .pNext = &pci};
  vkGetPhysicalDeviceProperties2(handle, &query);
  return fmt::format("{:04x}:{:02x}:{:02x}.{:x}", pci.pciDomain, pci.pciBus, pci.pciDevice, pci.pciFunction);
}

std::optional<PhysicalDevice> usable(VkPhysicalDevice handle) {
  PhysicalDevice physical{.handle = handle};
  vkGetPhysicalDeviceProperties(handle, &physical.properties);
  if (physical.properties.apiVersion < VK_API_VERSION_1_2) return std::nullopt;
  vkGetPhysicalDeviceFeatures(handle, &physical.features);
  VkPhysicalDeviceMaintenance3Properties memory{.sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_MAINTENANCE_3_PROPERTIES};
  VkPhysicalDeviceProperties2 query{.sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_PROPERTIES_2, .pNext = &memory};
  vkGetPhysicalDeviceProperties2(handle, &query);
  physical.most_memory = memory.maxMemoryAllocationSize;
  std::uint32_t count = 0;
  vkGetPhysicalDeviceQueueFamilyProperties(handle, &count, nullptr);
  std::vector<VkQueueFamilyProperties> families(count);
  vkGetPhysicalDeviceQueueFamilyProperties(handle, &count, families.data());
  constexpr VkQueueFlags kNeeded = VK_QUEUE_GRAPHICS_BIT | VK_QUEUE_COMPUTE_BIT;  // every device that draws has such
  for (std::uint32_t i = 0; i < count; ++i) {
    if ((families[i].queueFlags & kNeeded) != kNeeded) continue;
    physical.queue_family = i;
    physical.timestamp_bits = families[i].timestampValidBits;
    return physical;
  }
  return std::nullopt;
}

PhysicalDevice pick(const VulkanInstance& instance, int index) {
  const std::vector<PhysicalDevice> devices = physical_devices(instance);
  if (index < 0 || index >= static_cast<int>(devices.size())) {
    fail_environment("vulkan: no device {}: there are {}, counted from 0", index, devices.size());
  }
  return devices[static_cast<std::size_t>(index)];
}

}  // namespace

std::vector<PhysicalDevice> physical_devices(const VulkanInstance& instance) {
  std::uint32_t count = 0;
  vk_check(vkEnumeratePhysicalDevices(instance.handle(), &count, nullptr), "vkEnumeratePhysicalDevices");
  std::vector<VkPhysicalDevice> handles(count);
  vk_check(vkEnumeratePhysicalDevices(instance.handle(), &count, handles.data()), "vkEnumeratePhysicalDevices");
  std::vector<PhysicalDevice> devices;
  for (const VkPhysicalDevice handle : handles) {
    if (const auto physical = usable(handle)) devices.push_back(*physical);
  }
  return devices;
}

DeviceInfo device_info(const PhysicalDevice& physical, int index) {
  VkPhysicalDeviceDriverProperties driver{.sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_DRIVER_PROPERTIES};
  VkPhysicalDeviceProperties2 query{.sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_PROPERTIES_2, .pNext = &driver};
  vkGetPhysicalDeviceProperties2(physical.handle, &query);
  const VkPhysicalDeviceProperties& properties = query.properties;
  DeviceInfo info{.backend = "vulkan",
                  .index = index,
                  .name = properties.deviceName,
                  .vendor = vendor_name(properties.vendorID),
                  .type = std::string(type_name(properties.deviceType)),
                  .driver = fmt::format("{} {}", driver.driverName, driver.driverInfo),
                  .api_version = fmt::format("{}.{}.{}", VK_API_VERSION_MAJOR(properties.apiVersion),
                                             VK_API_VERSION_MINOR(properties.apiVersion),
                                             VK_API_VERSION_PATCH(properties.apiVersion)),
                  .software = properties.deviceType == VK_PHYSICAL_DEVICE_TYPE_CPU,
                  .timers = {Timer::fenced_wall},
                  .subtexel_bits = static_cast<int>(properties.limits.subTexelPrecisionBits),
                  .float64 = physical.features.shaderFloat64 == VK_TRUE,
                  .compiles_in_parallel = true,
                  .pci = pci_address(physical.handle)};
  for (const BlockFeature& block : kBlockFeatures)
    if (physical.features.*block.feature == VK_TRUE) info.blocks.push_back(block.type);
  if (physical.timestamp_bits > 0 && properties.limits.timestampPeriod > 0) info.timers.push_back(Timer::vk_timestamp);
  return info;
}

LogicalDevice::LogicalDevice(const PhysicalDevice& physical, bool presents) {
  const float priority = 1;
  const VkDeviceQueueCreateInfo queue{.sType = VK_STRUCTURE_TYPE_DEVICE_QUEUE_CREATE_INFO,
                                      .queueFamilyIndex = physical.queue_family,
                                      .queueCount = 1,
                                      .pQueuePriorities = &priority};
  const VkPhysicalDeviceFeatures features{.textureCompressionETC2 = physical.features.textureCompressionETC2,
                                          .textureCompressionASTC_LDR = physical.features.textureCompressionASTC_LDR,
                                          .textureCompressionBC = physical.features.textureCompressionBC,
                                          .shaderFloat64 = physical.features.shaderFloat64};
  const char* const swapchain = VK_KHR_SWAPCHAIN_EXTENSION_NAME;
  const VkDeviceCreateInfo info{.sType = VK_STRUCTURE_TYPE_DEVICE_CREATE_INFO,
                                .queueCreateInfoCount = 1,
                                .pQueueCreateInfos = &queue,
                                .enabledExtensionCount = presents ? 1U : 0U,
                                .ppEnabledExtensionNames = &swapchain,
                                .pEnabledFeatures = &features};
  vk_check(vkCreateDevice(physical.handle, &info, nullptr, &handle_), "vkCreateDevice");
  volkLoadDeviceTable(&calls_, handle_);
}

LogicalDevice::~LogicalDevice() { calls_.vkDestroyDevice(handle_, nullptr); }

VulkanDevice::VulkanDevice(int index, const BackendOptions& options, WindowExtensions window)
    : instance_(options.debug, window), physical_(pick(instance_, index)), logical_(physical_, !window.empty()) {
  if (options.keeps_pipelines) pipelines_ = PipelineCache(driver_text(physical_.properties));
  calls().vkGetDeviceQueue(handle(), physical_.queue_family, 0, &queue_);
  const VkCommandPoolCreateInfo pool_info{.sType = VK_STRUCTURE_TYPE_COMMAND_POOL_CREATE_INFO,
                                          .flags = VK_COMMAND_POOL_CREATE_TRANSIENT_BIT,
                                          .queueFamilyIndex = physical_.queue_family};
  VkCommandPool pool = VK_NULL_HANDLE;
  vk_check(calls().vkCreateCommandPool(handle(), &pool_info, nullptr, &pool), "vkCreateCommandPool");
  command_pool_ = {logical_, pool};
  const VkFenceCreateInfo fence_info{.sType = VK_STRUCTURE_TYPE_FENCE_CREATE_INFO};
  VkFence fence = VK_NULL_HANDLE;
  vk_check(calls().vkCreateFence(handle(), &fence_info, nullptr, &fence), "vkCreateFence");
  fence_ = {logical_, fence};
}

double VulkanDevice::run(std::span<const VkCommandBuffer> commands) const {
  const VkFence fence = fence_.get();
  const VkSubmitInfo submit{.sType = VK_STRUCTURE_TYPE_SUBMIT_INFO,
                            .commandBufferCount = static_cast<std::uint32_t>(commands.size()),
                            .pCommandBuffers = commands.data()};
  vk_check(calls().vkResetFences(handle(), 1, &fence), "vkResetFences");
  const auto start = std::chrono::steady_clock::now();
  vk_check(calls().vkQueueSubmit(queue_, 1, &submit, fence), "vkQueueSubmit");
  constexpr auto kForEver = std::numeric_limits<std::uint64_t>::max();
  vk_check(calls().vkWaitForFences(handle(), 1, &fence, VK_TRUE, kForEver), "vkWaitForFences");
  return std::chrono::duration<double, std::nano>(std::chrono::steady_clock::now() - start).count();
}

Commands::Commands(const VulkanDevice& device, VkCommandBufferUsageFlags usage) : device_(device) {
  const VkCommandBufferAllocateInfo info{.sType = VK_STRUCTURE_TYPE_COMMAND_BUFFER_ALLOCATE_INFO,
                                         .commandPool = device.command_pool(),
                                         .level = VK_COMMAND_BUFFER_LEVEL_PRIMARY,
                                         .commandBufferCount = 1};
  vk_check(device.calls().vkAllocateCommandBuffers(device.handle(), &info, &handle_), "vkAllocateCommandBuffers");
  const VkCommandBufferBeginInfo begin{.sType = VK_STRUCTURE_TYPE_COMMAND_BUFFER_BEGIN_INFO, .flags = usage};
  // On failure the pool frees the buffer.
  vk_check(device.calls().vkBeginCommandBuffer(handle_, &begin), "vkBeginCommandBuffer");
}

Commands::~Commands() { device_.calls().vkFreeCommandBuffers(device_.handle(), device_.command_pool(), 1, &handle_); }

VkCommandBuffer Commands::end() const {
  vk_check(device_.calls().vkEndCommandBuffer(handle_), "vkEndCommandBuffer");
  return handle_;
}

}  // namespace reliefbench
