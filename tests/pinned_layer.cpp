#include <dlfcn.h>
#include <gtest/gtest.h>

namespace {

/// Keeps Vulkan's validation layer loaded. It leaks, and once it is unloaded LeakSanitizer cannot tell whose leak it
/// is: the suppression in lsan.supp then misses.
class PinnedLayer final : public testing::Environment {
 public:
  void SetUp() override { static_cast<void>(dlopen("libVkLayer_khronos_validation.so", RTLD_NOW | RTLD_NODELETE)); }
};

const testing::Environment* const kPinnedLayer = testing::AddGlobalTestEnvironment(new PinnedLayer);

}  // namespace
