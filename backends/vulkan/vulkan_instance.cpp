#include <algorithm>
#include <array>
#include <cstdio>
#include <cstring>
#include <mutex>

#include "backends/vulkan/vulkan_device.h"
#include "kernels/base/error.h"

namespace reliefbench {
namespace {

constexpr const char* kValidationLayer = "VK_LAYER_KHRONOS_validation";

std::string_view words(VkResult result) {
  switch (result) {
    case VK_ERROR_DEVICE_LOST:
      return "device lost";
    case VK_ERROR_OUT_OF_HOST_MEMORY:
      return "out of host memory";
    case VK_ERROR_OUT_OF_DEVICE_MEMORY:
      return "out of device memory";
    case VK_ERROR_OUT_OF_POOL_MEMORY:
      return "out of pool memory";
    case VK_ERROR_INITIALIZATION_FAILED:
      return "initialisation failed";
    case VK_ERROR_INCOMPATIBLE_DRIVER:
      return "no driver found";
    case VK_ERROR_LAYER_NOT_PRESENT:
      return "layer not present";
    case VK_ERROR_EXTENSION_NOT_PRESENT:
      return "extension not present";
    case VK_ERROR_FEATURE_NOT_PRESENT:
      return "feature not present";
    case VK_ERROR_FORMAT_NOT_SUPPORTED:
      return "format not supported";
    case VK_ERROR_TOO_MANY_OBJECTS:
      return "too many objects";
    default:
      return "Vulkan error";
  }
}

bool layer_present(std::string_view name) {
  std::uint32_t count = 0;
  vk_check(vkEnumerateInstanceLayerProperties(&count, nullptr), "vkEnumerateInstanceLayerProperties");
  std::vector<VkLayerProperties> layers(count);
  vk_check(vkEnumerateInstanceLayerProperties(&count, layers.data()), "vkEnumerateInstanceLayerProperties");
  return std::ranges::any_of(layers, [name](const VkLayerProperties& layer) { return name == layer.layerName; });
}

VKAPI_ATTR VkBool32 VKAPI_CALL collect(VkDebugUtilsMessageSeverityFlagBitsEXT, VkDebugUtilsMessageTypeFlagsEXT,
                                       const VkDebugUtilsMessengerCallbackDataEXT* data, void* messages) {
  static std::mutex mutex;  // any thread that makes a call may be told
  const std::lock_guard lock(mutex);
  static_cast<std::vector<std::string>*>(messages)->emplace_back(data->pMessage);
  fmt::print(stderr, "{}\n", data->pMessage);
  return VK_FALSE;
}

}  // namespace

Fault fault_of(VkResult result) {
  switch (result) {
    case VK_ERROR_DEVICE_LOST:
      return Fault::device_lost;
    case VK_ERROR_OUT_OF_HOST_MEMORY:
    case VK_ERROR_OUT_OF_DEVICE_MEMORY:
    case VK_ERROR_OUT_OF_POOL_MEMORY:
      return Fault::out_of_memory;
    default:
      return Fault::other;
  }
}

void vk_check(VkResult result, std::string_view call) {
  if (result == VK_SUCCESS) return;
  fail_device(fault_of(result), "vulkan: {} failed: {} (VkResult {})", call, words(result), static_cast<int>(result));
}

VulkanInstance::VulkanInstance(bool debug, WindowExtensions window) {
  if (volkInitialize() != VK_SUCCESS) fail_environment("vulkan: no Vulkan loader (libvulkan.so.1) on this system");
  if (volkGetInstanceVersion() < VK_API_VERSION_1_2) fail_environment("vulkan: the loader is older than Vulkan 1.2");
  if (debug && !layer_present(kValidationLayer)) {
    fail_environment("vulkan: debug was asked for, but the layer {} is not installed", kValidationLayer);
  }
  const VkApplicationInfo application{
      .sType = VK_STRUCTURE_TYPE_APPLICATION_INFO, .pApplicationName = "reliefbench", .apiVersion = VK_API_VERSION_1_2};
  // Not the `general` type: through it the loader complains of drivers that have no hardware here.
  const VkDebugUtilsMessengerCreateInfoEXT messenger{
      .sType = VK_STRUCTURE_TYPE_DEBUG_UTILS_MESSENGER_CREATE_INFO_EXT,
      .messageSeverity =
          VK_DEBUG_UTILS_MESSAGE_SEVERITY_WARNING_BIT_EXT | VK_DEBUG_UTILS_MESSAGE_SEVERITY_ERROR_BIT_EXT,
      .messageType = VK_DEBUG_UTILS_MESSAGE_TYPE_VALIDATION_BIT_EXT | VK_DEBUG_UTILS_MESSAGE_TYPE_PERFORMANCE_BIT_EXT,
      .pfnUserCallback = collect,
      .pUserData = &messages_};
  const VkValidationFeatureEnableEXT synchronization = VK_VALIDATION_FEATURE_ENABLE_SYNCHRONIZATION_VALIDATION_EXT;
  const VkValidationFeaturesEXT validation{.sType = VK_STRUCTURE_TYPE_VALIDATION_FEATURES_EXT,
                                           .pNext = &messenger,
                                           .enabledValidationFeatureCount = 1,
                                           .pEnabledValidationFeatures = &synchronization};
  std::vector<const char*> extensions(window.begin(), window.end());
  if (debug)
    extensions.insert(extensions.end(), {VK_EXT_DEBUG_UTILS_EXTENSION_NAME, VK_EXT_VALIDATION_FEATURES_EXTENSION_NAME});
  const VkInstanceCreateInfo info{.sType = VK_STRUCTURE_TYPE_INSTANCE_CREATE_INFO,
                                  .pNext = debug ? &validation : nullptr,
                                  .pApplicationInfo = &application,
                                  .enabledLayerCount = debug ? 1U : 0U,
                                  .ppEnabledLayerNames = &kValidationLayer,
                                  .enabledExtensionCount = static_cast<std::uint32_t>(extensions.size()),
                                  .ppEnabledExtensionNames = extensions.data()};
  vk_check(vkCreateInstance(&info, nullptr, &handle_), "vkCreateInstance");
  volkLoadInstanceOnly(handle_);
  if (debug) start_messenger(messenger);
}

void VulkanInstance::start_messenger(const VkDebugUtilsMessengerCreateInfoEXT& info) {
  const auto load = [this](const char* name) { return vkGetInstanceProcAddr(handle_, name); };
  // The layer that was just enabled provides these three.
  const auto create = reinterpret_cast<PFN_vkCreateDebugUtilsMessengerEXT>(load("vkCreateDebugUtilsMessengerEXT"));
  destroy_messenger_ = reinterpret_cast<PFN_vkDestroyDebugUtilsMessengerEXT>(load("vkDestroyDebugUtilsMessengerEXT"));
  set_object_name_ = reinterpret_cast<PFN_vkSetDebugUtilsObjectNameEXT>(load("vkSetDebugUtilsObjectNameEXT"));
  const VkResult result = create(handle_, &info, nullptr, &messenger_);
  if (result == VK_SUCCESS) return;
  vkDestroyInstance(handle_, nullptr);  // this object's destructor will not run
  vk_check(result, "vkCreateDebugUtilsMessengerEXT");
}

VulkanInstance::~VulkanInstance() {
  if (messenger_ != VK_NULL_HANDLE) destroy_messenger_(handle_, messenger_, nullptr);
  vkDestroyInstance(handle_, nullptr);
}

}  // namespace reliefbench
