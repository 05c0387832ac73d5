#pragma once
#include <memory>
#include <string>
#include <utility>

namespace reliefbench {

/// A name that many objects bear: copies share its letters.
class SharedName {
 public:
  SharedName() = default;
  SharedName(std::string name) : name_(std::make_shared<const std::string>(std::move(name))) {}  // NOLINT(*-explicit-*)
  SharedName(const char* name) : SharedName(std::string(name)) {}                                // NOLINT(*-explicit-*)

  [[nodiscard]] const std::string& text() const {
    static const std::string none;
    return name_ == nullptr ? none : *name_;
  }
  operator const std::string&() const { return text(); }  // NOLINT(*-explicit-*)

  friend bool operator==(const SharedName& a, const SharedName& b) {
    return a.name_ == b.name_ || a.text() == b.text();
  }
  friend bool operator==(const SharedName& a, const std::string& b) { return a.text() == b; }
  friend bool operator==(const SharedName& a, const char* b) { return a.text() == b; }

 private:
  std::shared_ptr<const std::string> name_;
};

}  // namespace reliefbench
