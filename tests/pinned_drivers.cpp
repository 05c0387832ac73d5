#include <dlfcn.h>
#include <gtest/gtest.h>

namespace {

/// Keeps the validation layer and lavapipe loaded. They leak, and once a library is unloaded LeakSanitizer cannot tell
/// whose leak it is: the suppression in lsan.supp then misses.
class PinnedDrivers final : public testing::Environment {
 public:
  void SetUp() override {
    for (const char* library : {"libVkLayer_khronos_validation.so", "libvulkan_lvp.so"})
      static_cast<void>(dlopen(library, RTLD_NOW | RTLD_NODELETE));
  }
};

const testing::Environment* const kPinnedDrivers = testing::AddGlobalTestEnvironment(new PinnedDrivers);

}  // namespace
