#pragma once
#include <filesystem>
#include <utility>
#include <vector>

#include "tests/scoped_variable.h"

namespace reliefbench {

/// Where this process keeps bakes and translations until the end of the scope: a folder that is empty at first.
class OwnCache {
 public:
  explicit OwnCache(std::filesystem::path folder)
      : folder_(std::move(folder)), variable_("RELIEFBENCH_CACHE", folder_.string()) {}

  [[nodiscard]] std::vector<std::filesystem::path> files() const {
    std::vector<std::filesystem::path> files;
    for (const auto& entry : std::filesystem::directory_iterator(folder_)) files.push_back(entry.path());
    return files;
  }

 private:
  std::filesystem::path folder_;
  ScopedVariable variable_;
};

}  // namespace reliefbench
