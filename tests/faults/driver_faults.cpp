// A driver that fails: preloaded under OpenGL (libepoxy's pointers to its calls are ours then), and a layer of Vulkan's
// loader. DRIVER_FAULTS is a list "WHAT after TEXT; WHAT at N; WHAT at N of CALL; ...":
//   WHAT   crash | hang | lost | memory
//   TEXT   the first draw fails after a shader was made whose code holds this
//   N      the N-th draw fails, counted over all processes in the file DRIVER_FAULT_COUNT
//   CALL   draw (also a dispatch, and of Vulkan a submission) | memory (an allocation) | wait (for the device)
// That file holds how many there were of each CALL, as int.
#include <GL/gl.h>
#include <GL/glext.h>
#include <dlfcn.h>
#include <fcntl.h>
#include <sys/mman.h>
#include <unistd.h>
#include <vulkan/vk_layer.h>
#include <vulkan/vulkan.h>

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <sstream>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace {

enum Call : std::size_t { kDraw, kMemory, kWait, kCalls };
constexpr std::array<const char*, kCalls> kCallNames = {"draw", "memory", "wait"};

struct DriverFault {
  std::string what;
  std::string text;
  std::string call = kCallNames[kDraw];
  int at = 0;
  bool is_armed = false;
};

std::vector<DriverFault>& faults() {
  static std::vector<DriverFault> list = [] {
    std::vector<DriverFault> made;
    const char* const given = std::getenv("DRIVER_FAULTS");
    std::istringstream entries(given == nullptr ? "" : given);
    for (std::string entry; std::getline(entries, entry, ';');) {
      DriverFault fault;
      std::string how;
      std::istringstream words(entry);
      words >> fault.what >> how >> fault.text;
      if (how == "at") fault.at = std::atoi(fault.text.c_str());
      if (std::string of; words >> of) words >> fault.call;
      made.push_back(fault);
    }
    return made;
  }();
  return list;
}

/// The number of this call, from 1.
int count(Call call) {
  using Counts = std::array<std::atomic<int>, kCalls>;
  static Counts* const counts = []() -> Counts* {
    const char* const path = std::getenv("DRIVER_FAULT_COUNT");
    const int fd = path == nullptr ? -1 : open(path, O_RDWR | O_CREAT | O_CLOEXEC, 0666);
    if (fd < 0 || ftruncate(fd, sizeof(Counts)) != 0) return new Counts{};
    return static_cast<Counts*>(mmap(nullptr, sizeof(Counts), PROT_READ | PROT_WRITE, MAP_SHARED, fd, 0));
  }();
  return ++counts->at(call);
}

void see_shader(const void* code, std::size_t bytes) {
  const std::string_view text(static_cast<const char*>(code), bytes);
  for (DriverFault& fault : faults())
    if (fault.at == 0 && text.find(fault.text) != std::string_view::npos) fault.is_armed = true;
}

/// What the caller is to fail with: "lost", "memory" or "".
std::string_view fault_of(Call call) {
  const int number = count(call);
  for (DriverFault& fault : faults()) {
    if (fault.call != kCallNames.at(call)) continue;
    if (!std::exchange(fault.is_armed, false) && number != fault.at) continue;
    std::fprintf(stderr, "test driver: %s in %s %d\n", fault.what.c_str(), kCallNames.at(call), number);
    if (fault.what == "crash") std::abort();
    while (fault.what == "hang") pause();
    return fault.what;
  }
  return "";
}

template <typename Function>
Function* gl(const char* name) {
  static void* const egl = dlopen("libEGL.so.1", RTLD_LAZY);
  const auto get = reinterpret_cast<void (*(*)(const char*))()>(dlsym(egl, "eglGetProcAddress"));
  return reinterpret_cast<Function*>(get(name));
}

bool is_context_lost = false;
bool is_memory_out = false;

/// Whether the call is to be made.
bool goes_well(Call call) {
  const std::string_view fault = fault_of(call);
  is_context_lost |= fault == "lost";
  is_memory_out |= fault == "memory";
  return fault.empty();
}

void draw_arrays(GLenum mode, GLint first, GLsizei count) {
  if (goes_well(kDraw)) gl<void(GLenum, GLint, GLsizei)>("glDrawArrays")(mode, first, count);
}
void dispatch_compute(GLuint x, GLuint y, GLuint z) {
  if (goes_well(kDraw)) gl<void(GLuint, GLuint, GLuint)>("glDispatchCompute")(x, y, z);
}
void texture_storage(GLuint texture, GLsizei levels, GLenum format, GLsizei width, GLsizei height) {
  if (goes_well(kMemory))
    gl<void(GLuint, GLsizei, GLenum, GLsizei, GLsizei)>("glTextureStorage2D")(texture, levels, format, width, height);
}
void finish() {
  if (goes_well(kWait)) gl<void()>("glFinish")();
}

void shader_binary(GLsizei count, const GLuint* shaders, GLenum format, const void* code, GLsizei bytes) {
  see_shader(code, static_cast<std::size_t>(bytes));
  gl<void(GLsizei, const GLuint*, GLenum, const void*, GLsizei)>("glShaderBinary")(count, shaders, format, code, bytes);
}

GLenum get_error() {
  if (is_context_lost) return GL_CONTEXT_LOST;
  return std::exchange(is_memory_out, false) ? GL_OUT_OF_MEMORY : gl<GLenum()>("glGetError")();
}

GLenum get_reset_status() {
  return is_context_lost ? GL_GUILTY_CONTEXT_RESET : gl<GLenum()>("glGetGraphicsResetStatus")();
}

PFN_vkGetInstanceProcAddr next_of_instance = nullptr;
PFN_vkGetDeviceProcAddr next_of_device = nullptr;
VkInstance the_instance = VK_NULL_HANDLE;
VkDevice the_device = VK_NULL_HANDLE;

/// The loader's link to the next layer.
template <typename Link>
Link* link_of(const void* chain, VkStructureType type) {
  auto* link = static_cast<Link*>(const_cast<void*>(chain));
  while (link != nullptr && (link->sType != type || link->function != VK_LAYER_LINK_INFO))
    link = static_cast<Link*>(const_cast<void*>(link->pNext));
  return link;
}

VkResult VKAPI_CALL create_instance(const VkInstanceCreateInfo* info, const VkAllocationCallbacks* memory,
                                    VkInstance* instance) {
  auto* const link = link_of<VkLayerInstanceCreateInfo>(info->pNext, VK_STRUCTURE_TYPE_LOADER_INSTANCE_CREATE_INFO);
  if (link == nullptr) return VK_ERROR_INITIALIZATION_FAILED;
  next_of_instance = link->u.pLayerInfo->pfnNextGetInstanceProcAddr;
  link->u.pLayerInfo = link->u.pLayerInfo->pNext;
  const auto create = reinterpret_cast<PFN_vkCreateInstance>(next_of_instance(nullptr, "vkCreateInstance"));
  const VkResult result = create(info, memory, instance);
  the_instance = *instance;
  return result;
}

VkResult VKAPI_CALL create_device(VkPhysicalDevice physical, const VkDeviceCreateInfo* info,
                                  const VkAllocationCallbacks* memory, VkDevice* device) {
  auto* const link = link_of<VkLayerDeviceCreateInfo>(info->pNext, VK_STRUCTURE_TYPE_LOADER_DEVICE_CREATE_INFO);
  if (link == nullptr) return VK_ERROR_INITIALIZATION_FAILED;
  next_of_device = link->u.pLayerInfo->pfnNextGetDeviceProcAddr;
  const auto create = reinterpret_cast<PFN_vkCreateDevice>(
      link->u.pLayerInfo->pfnNextGetInstanceProcAddr(the_instance, "vkCreateDevice"));
  link->u.pLayerInfo = link->u.pLayerInfo->pNext;
  const VkResult result = create(physical, info, memory, device);
  the_device = *device;
  return result;
}

VkResult VKAPI_CALL create_shader_module(VkDevice device, const VkShaderModuleCreateInfo* info,
                                         const VkAllocationCallbacks* memory, VkShaderModule* module) {
  see_shader(info->pCode, info->codeSize);
  const auto create = reinterpret_cast<PFN_vkCreateShaderModule>(next_of_device(device, "vkCreateShaderModule"));
  return create(device, info, memory, module);
}

bool is_device_lost = false;

/// A submission counts as a draw.
VkResult VKAPI_CALL queue_submit(VkQueue queue, std::uint32_t count, const VkSubmitInfo* submits, VkFence fence) {
  const std::string_view fault = fault_of(kDraw);
  is_device_lost |= fault == "lost";
  if (is_device_lost) return VK_ERROR_DEVICE_LOST;
  if (fault == "memory") return VK_ERROR_OUT_OF_DEVICE_MEMORY;
  const auto submit = reinterpret_cast<PFN_vkQueueSubmit>(next_of_device(the_device, "vkQueueSubmit"));
  return submit(queue, count, submits, fence);
}

VkResult VKAPI_CALL allocate_memory(VkDevice device, const VkMemoryAllocateInfo* info,
                                    const VkAllocationCallbacks* callbacks, VkDeviceMemory* memory) {
  if (fault_of(kMemory) == "memory") return VK_ERROR_OUT_OF_DEVICE_MEMORY;
  const auto allocate = reinterpret_cast<PFN_vkAllocateMemory>(next_of_device(device, "vkAllocateMemory"));
  return allocate(device, info, callbacks, memory);
}

VkResult VKAPI_CALL wait_for_fences(VkDevice device, std::uint32_t count, const VkFence* fences, VkBool32 all,
                                    std::uint64_t timeout) {
  is_device_lost |= fault_of(kWait) == "lost";
  if (is_device_lost) return VK_ERROR_DEVICE_LOST;
  const auto wait = reinterpret_cast<PFN_vkWaitForFences>(next_of_device(device, "vkWaitForFences"));
  return wait(device, count, fences, all, timeout);
}

/// What it keeps of pipelines is more than a header, which is all that lavapipe gives.
VkResult VKAPI_CALL get_cache_data(VkDevice device, VkPipelineCache cache, std::size_t* size, void* data) {
  constexpr std::size_t kMore = 16;
  const auto get = reinterpret_cast<PFN_vkGetPipelineCacheData>(next_of_device(device, "vkGetPipelineCacheData"));
  std::size_t own = data == nullptr ? 0 : *size - kMore;
  const VkResult result = get(device, cache, &own, data);
  if (data != nullptr) std::memset(static_cast<char*>(data) + own, 1, kMore);
  *size = own + kMore;
  return result;
}

PFN_vkVoidFunction VKAPI_CALL device_call(VkDevice device, const char* name) {
  const std::string_view call = name;
  if (call == "vkGetDeviceProcAddr") return reinterpret_cast<PFN_vkVoidFunction>(&device_call);
  if (call == "vkCreateShaderModule") return reinterpret_cast<PFN_vkVoidFunction>(&create_shader_module);
  if (call == "vkQueueSubmit") return reinterpret_cast<PFN_vkVoidFunction>(&queue_submit);
  if (call == "vkAllocateMemory") return reinterpret_cast<PFN_vkVoidFunction>(&allocate_memory);
  if (call == "vkWaitForFences") return reinterpret_cast<PFN_vkVoidFunction>(&wait_for_fences);
  if (call == "vkGetPipelineCacheData") return reinterpret_cast<PFN_vkVoidFunction>(&get_cache_data);
  return device == VK_NULL_HANDLE ? nullptr : next_of_device(device, name);
}

PFN_vkVoidFunction VKAPI_CALL instance_call(VkInstance instance, const char* name) {
  const std::string_view call = name;
  if (call == "vkGetInstanceProcAddr") return reinterpret_cast<PFN_vkVoidFunction>(&instance_call);
  if (call == "vkCreateInstance") return reinterpret_cast<PFN_vkVoidFunction>(&create_instance);
  if (call == "vkCreateDevice") return reinterpret_cast<PFN_vkVoidFunction>(&create_device);
  if (const auto own = device_call(VK_NULL_HANDLE, name); own != nullptr) return own;
  return instance == VK_NULL_HANDLE ? nullptr : next_of_instance(instance, name);
}

}  // namespace

extern "C" {

void (*epoxy_glDrawArrays)(GLenum, GLint, GLsizei) = draw_arrays;
void (*epoxy_glDispatchCompute)(GLuint, GLuint, GLuint) = dispatch_compute;
void (*epoxy_glTextureStorage2D)(GLuint, GLsizei, GLenum, GLsizei, GLsizei) = texture_storage;
void (*epoxy_glFinish)() = finish;
void (*epoxy_glShaderBinary)(GLsizei, const GLuint*, GLenum, const void*, GLsizei) = shader_binary;
GLenum (*epoxy_glGetError)() = get_error;
GLenum (*epoxy_glGetGraphicsResetStatus)() = get_reset_status;

VkResult VKAPI_CALL vkNegotiateLoaderLayerInterfaceVersion(VkNegotiateLayerInterface* layer) {
  layer->loaderLayerInterfaceVersion = 2;
  layer->pfnGetInstanceProcAddr = &instance_call;
  layer->pfnGetDeviceProcAddr = &device_call;
  layer->pfnGetPhysicalDeviceProcAddr = nullptr;
  return VK_SUCCESS;
}
}
