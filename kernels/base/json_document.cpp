#include "kernels/base/json_document.h"

#include <algorithm>
#include <cstddef>
#include <iterator>
#include <unordered_set>
#include <utility>

#include "kernels/base/error.h"

namespace reliefbench {
namespace {

using nlohmann::json;

/// How far the lexer has read. It reads a number up to the character after it, so that the last character read
/// does not count: after `8\n` the line is still that of the 8.
class LineCounter {
 public:
  void read(char c) {
    line_ += last_ == '\n' ? 1 : 0;
    last_ = c;
  }
  [[nodiscard]] int line() const { return line_; }

 private:
  int line_ = 1;
  char last_ = 0;
};

/// A text iterator that tells a LineCounter of every character it leaves.
class CountingIterator {
 public:
  using iterator_category = std::input_iterator_tag;
  using value_type = char;
  using difference_type = std::ptrdiff_t;
  using pointer = const char*;
  using reference = const char&;

  CountingIterator(const char* place, LineCounter* counter) : place_(place), counter_(counter) {}
  reference operator*() const { return *place_; }
  CountingIterator& operator++() {
    counter_->read(*place_++);
    return *this;
  }
  bool operator==(const CountingIterator& other) const { return place_ == other.place_; }
  bool operator!=(const CountingIterator& other) const { return place_ != other.place_; }

 private:
  const char* place_;
  LineCounter* counter_;
};

/// Receives the parser's events and builds the tree.
class TreeBuilder : public nlohmann::json_sax<json> {
 public:
  TreeBuilder(const LineCounter& counter, std::string_view file) : counter_(counter), file_(file) {}

  JsonNode take() { return std::move(root_); }

  bool null() override { return scalar(nullptr); }
  bool boolean(bool value) override { return scalar(value); }
  bool number_integer(number_integer_t value) override { return scalar(value); }
  bool number_unsigned(number_unsigned_t value) override { return scalar(value); }
  bool number_float(number_float_t value, const string_t& /*text*/) override { return scalar(value); }
  bool string(string_t& value) override { return scalar(std::move(value)); }
  bool binary(binary_t& /*value*/) override { return false; }  // not in JSON text
  bool start_object(std::size_t /*size*/) override { return open(json::object()); }
  bool start_array(std::size_t /*size*/) override { return open(json::array()); }
  bool end_object() override { return close(); }
  bool end_array() override { return close(); }

  bool key(string_t& name) override {
    const JsonNode& object = *open_.back();
    pending_key_ = name;
    pending_line_ = counter_.line();
    if (!keys_.back().insert(name).second)
      fail_input("{}:{}: key '{}': stands twice, first in line {}", file_, pending_line_, child_path(),
                 object.find(name)->line);
    return true;
  }

  bool parse_error(std::size_t /*position*/, const std::string& /*token*/, const json::exception& error) override {
    // "[json.exception...] parse error at line 3, column 5: <what>" or "[...] <what>"
    std::string_view what = error.what();
    for (const std::string_view mark : {"] ", "parse error at line ", ": "})
      if (const auto at = what.find(mark); at != std::string_view::npos) what.remove_prefix(at + mark.size());
    fail_input("{}:{}: not valid JSON: {}", file_, counter_.line(), what);
  }

 private:
  [[nodiscard]] std::string child_path() const {
    const JsonNode& parent = *open_.back();
    if (parent.value.is_array()) return fmt::format("{}[{}]", parent.path, parent.children.size());
    return parent.path.empty() ? pending_key_ : parent.path + "." + pending_key_;
  }

  JsonNode& add(json value) {
    if (open_.empty()) {
      root_ = {.key = "", .path = "", .line = counter_.line(), .value = std::move(value), .children = {}};
      return root_;
    }
    JsonNode& parent = *open_.back();
    const bool in_object = parent.value.is_object();
    parent.children.push_back({.key = in_object ? pending_key_ : "",
                               .path = child_path(),
                               .line = in_object ? pending_line_ : counter_.line(),
                               .value = std::move(value),
                               .children = {}});
    return parent.children.back();
  }

  bool scalar(json value) {
    add(std::move(value));
    return true;
  }

  bool open(json empty) {
    if (open_.size() == kJsonDepthLimit)
      fail_input("{}:{}: over {} levels deep", file_, counter_.line(), kJsonDepthLimit);
    // The pointers stay good: only the innermost open node gets new children.
    open_.push_back(&add(std::move(empty)));
    keys_.emplace_back();
    return true;
  }

  bool close() {
    open_.pop_back();
    keys_.pop_back();
    return true;
  }

  const LineCounter& counter_;
  std::string_view file_;
  JsonNode root_;
  std::vector<JsonNode*> open_;
  std::vector<std::unordered_set<std::string>> keys_;  ///< of each open object so far: a list of them is slow to search
  std::string pending_key_;
  int pending_line_ = 1;
};

}  // namespace

const JsonNode* JsonNode::find(std::string_view child_key) const {
  const auto found = std::ranges::find(children, child_key, &JsonNode::key);
  return value.is_object() && found != children.end() ? &*found : nullptr;
}

JsonNode parse_json_document(std::string_view text, std::string_view file) {
  LineCounter counter;
  TreeBuilder builder(counter, file);
  const CountingIterator begin(text.data(), &counter);
  const CountingIterator end(text.data() + text.size(), &counter);
  constexpr bool kWholeText = true;
  constexpr bool kAllowComments = true;
  json::sax_parse(begin, end, &builder, json::input_format_t::json, kWholeText, kAllowComments);
  return builder.take();
}

}  // namespace reliefbench
