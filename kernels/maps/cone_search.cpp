#include "kernels/maps/cone_search.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>

#include "kernels/base/parallel.h"
#include "kernels/maps/max_pyramid.h"

// The traversal is compiled once for every x86 level; the best that the machine has is chosen at run time.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "kernels/maps/cone_search.cpp"  // NOLINT(bugprone-macro-parentheses)
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace reliefbench {
namespace HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

constexpr int kSide = 4;  // texels along a packet
constexpr std::size_t kLanes = std::size_t{kSide} * kSide;
constexpr int kBand = 32;                 // rows of texels a task: long enough to pass best targets down
constexpr float kMargin = 1 + 4e-6F;      // over the rounding of a bound in float
constexpr double kViewMargin = 1.0 / 64;  // texels, over the rounding of a view's half-planes in float

/// A texel of the map, or under repeat of any image of it.
struct Place {
  int x, y;
};

/// How offsets are measured: on the plane; round the torus to the nearest image; or on the plane within a view, where
/// each image is searched by itself.
enum class Space { plane, torus, view };

/// 4 x 4 texels that share one traversal.
template <Space kSpace>
class Packet {
  // NOLINTBEGIN(cppcoreguidelines-pro-type-member-init): filled by start()
 public:
  explicit Packet(const ConeSearch& search)
      : search_(search), width_(search.heights.width), height_(search.heights.height) {
    const ConeMetric& metric = search.metric;
    aspect_ = static_cast<float>(metric.weight_x / metric.weight_y);
    slack_ = static_cast<float>(metric.slack / metric.weight_y);
    widest_ = metric.side * static_cast<double>(search.max_ratio);
  }

  void start(int x, int y) {
    for (int i = 0; i < kSide * kSide; ++i) {
      // Lanes outside the map repeat its last row and column.
      const int px = std::min(x + i % kSide, width_ - 1);
      const int py = std::min(y + i / kSide, height_ - 1);
      x_[i] = static_cast<float>(px);
      y_[i] = static_cast<float>(py);
      height_f_[i] = search_.heights.at(px, py);
      x_d_[i] = px;
      y_d_[i] = py;
      height_d_[i] = height_f_[i];
      key_[i] = widest_ * widest_;
    }
    forget_targets();
    lowest_ = *std::min_element(height_f_, height_f_ + kLanes);
    centre_x_ = static_cast<float>(x) + 0.5F * (kSide - 1);
    centre_y_ = static_cast<float>(y) + 0.5F * (kSide - 1);
    update_limits();
  }

  /// The candidates of what follows, and the view that they are seen in (null: all count).
  void look(const MaxPyramid& pyramid, const ConeView* view) {
    pyramid_ = &pyramid;
    view_ = view;
    forget_targets();
  }

  /// The texel that last lowered the key of lane `i` since look(); the lane itself where none did.
  [[nodiscard]] Place target(int i) const {
    return {.x = static_cast<int>(target_x_[i]), .y = static_cast<int>(target_y_[i])};
  }

  [[nodiscard]] float ratio(int i) const { return ratio_of_key(key_[i], search_.metric); }

  void try_texel(Place place) {
    const auto column = static_cast<std::size_t>(wrapped(place.x, width_, search_.wrap));
    const auto row = static_cast<std::size_t>(wrapped(place.y, height_, search_.wrap));
    const float top = pyramid_->levels().front().at(column, row);
    const auto x = static_cast<float>(place.x);
    const auto y = static_cast<float>(place.y);
    if (may_improve(x, y, 0, top)) evaluate(place.x, place.y, top);
  }

  /// Searches the image of the map whose first texel is at `origin`.
  void search_image(Place origin) {
    struct Node {
      std::uint16_t x, y;
      int level;
    };
    const auto& levels = pyramid_->levels();
    std::array<Node, 64> stack;  // at most three nodes wait on each of 17 levels, and one is open
    std::size_t count = 0;
    stack[count++] = {0, 0, static_cast<int>(levels.size()) - 1};
    while (count > 0) {
      const Node node = stack[--count];
      const MaxPyramid::Level& level = levels[static_cast<std::size_t>(node.level)];
      const float top = level.at(node.x, node.y);
      if (top <= lowest_) continue;  // padding too: it has no children
      const auto size = static_cast<float>(1 << node.level);
      const float middle_x = (static_cast<float>(node.x) + 0.5F) * size - 0.5F + static_cast<float>(origin.x);
      const float middle_y = (static_cast<float>(node.y) + 0.5F) * size - 0.5F + static_cast<float>(origin.y);
      if (!may_improve(middle_x, middle_y, 0.5F * (size - 1), top)) continue;
      if (node.level == 0) {
        evaluate(node.x + origin.x, node.y + origin.y, top);
        continue;
      }
      const int near_x = is_right_nearer(centre_x_ - middle_x, static_cast<float>(width_));
      const int near_y = is_right_nearer(centre_y_ - middle_y, static_cast<float>(height_));
      for (const int child : {3, 2, 1, 0}) {  // the near child is on top of the stack
        stack[count++] = {static_cast<std::uint16_t>(2 * node.x + (near_x ^ (child & 1))),
                          static_cast<std::uint16_t>(2 * node.y + (near_y ^ (child >> 1))), node.level - 1};
      }
    }
  }

 private:
  using F = HWY_CAPPED(float, kLanes);
  using D = HWY_CAPPED(double, kLanes / 2);

  static int is_right_nearer(float offset, float side) {
    if (kSpace == Space::torus && std::abs(offset) > 0.5F * side) offset = -offset;
    return offset > 0 ? 1 : 0;
  }

  void forget_targets() {
    std::copy_n(x_d_, kLanes, target_x_);
    std::copy_n(y_d_, kLanes, target_y_);
  }

  /// offset: to a box's middle
  template <class T>
  static hn::Vec<T> distance(T tag, hn::Vec<T> offset, int side) {
    const auto d = hn::Abs(offset);
    if constexpr (kSpace != Space::torus) return d;
    return hn::Min(d, hn::Sub(hn::Set(tag, static_cast<hn::TFromD<T>>(side)), d));
  }

  /// Whether the view has any of the box of half side `reach` round the offset.
  template <class T>
  HWY_INLINE hn::Mask<T> sees(T tag, hn::Vec<T> dx, hn::Vec<T> dy, double reach) const {
    using Number = hn::TFromD<T>;
    auto is_seen = hn::Eq(dx, dx);
    for (const ConeView::Normal& normal : view_->normals) {
      if (normal.x == 0 && normal.y == 0) break;
      const double slack = (view_->margin + reach) * (std::abs(normal.x) + std::abs(normal.y));
      const auto along = hn::Add(hn::Mul(dx, hn::Set(tag, static_cast<Number>(normal.x))),
                                 hn::Mul(dy, hn::Set(tag, static_cast<Number>(normal.y))));
      is_seen = hn::And(is_seen, hn::Ge(along, hn::Set(tag, static_cast<Number>(-slack))));
    }
    return is_seen;
  }

  /// Whether a texel in a box of half side `reach` texels, none higher than `top`, may lower any lane's key.
  HWY_INLINE bool may_improve(float x, float y, float reach, float top) const {
    const F f;
    const auto zero = hn::Zero(f);
    bool any = false;
    for (std::size_t i = 0; i < kLanes; i += hn::Lanes(f)) {
      const auto half = hn::Set(f, reach);
      const auto offset_x = hn::Sub(hn::Set(f, x), hn::Load(f, x_ + i));
      const auto offset_y = hn::Sub(hn::Set(f, y), hn::Load(f, y_ + i));
      const auto dx = hn::Max(hn::Sub(distance(f, offset_x, width_), half), zero);
      const auto dy = hn::Max(hn::Sub(distance(f, offset_y, height_), half), zero);
      const auto distance2 = hn::MulAdd(hn::Mul(dx, hn::Set(f, aspect_)), dx, hn::Mul(dy, dy));
      const auto rise = hn::Max(hn::Sub(hn::Set(f, top), hn::Load(f, height_f_ + i)), zero);
      const auto bound = hn::MulAdd(hn::Mul(hn::Load(f, limit_ + i), rise), rise, hn::Set(f, slack_));
      auto improves = hn::Lt(distance2, bound);
      if constexpr (kSpace == Space::view) {
        improves = hn::And(improves, sees(f, offset_x, offset_y, static_cast<double>(reach) + kViewMargin));
      }
      any = any || !hn::AllFalse(f, improves);
    }
    return any;
  }

  void evaluate(int x, int y, float top) {
    if (kSpace != Space::view && search_.pair_key != nullptr) {
      evaluate_pairs(x, y, top);
    } else {
      evaluate_texel(x, y, top);
    }
  }

  /// Lowers the lanes' keys by one texel, in double precision: the expression that a loop over all pairs has.
  HWY_NOINLINE void evaluate_texel(int x, int y, float top) {
    const D d;
    const ConeMetric& metric = search_.metric;
    bool improved = false;
    for (std::size_t i = 0; i < kLanes; i += hn::Lanes(d)) {
      const auto offset_x = hn::Sub(hn::Set(d, x), hn::Load(d, x_d_ + i));
      const auto offset_y = hn::Sub(hn::Set(d, y), hn::Load(d, y_d_ + i));
      const auto dx = distance(d, offset_x, width_);
      const auto dy = distance(d, offset_y, height_);
      const auto distance2 = hn::Sub(hn::Add(hn::Mul(hn::Mul(dx, dx), hn::Set(d, metric.weight_x)),
                                             hn::Mul(hn::Mul(dy, dy), hn::Set(d, metric.weight_y))),
                                     hn::Set(d, metric.slack));
      const auto rise = hn::Sub(hn::Set(d, static_cast<double>(top)), hn::Load(d, height_d_ + i));
      const auto key = hn::Load(d, key_ + i);
      const auto found = hn::Div(distance2, hn::Mul(rise, rise));
      auto better = hn::And(hn::Lt(found, key), hn::Gt(rise, hn::Zero(d)));
      if constexpr (kSpace == Space::view) better = hn::And(better, sees(d, offset_x, offset_y, 0));
      if (hn::AllFalse(d, better)) continue;
      improved = true;
      hn::Store(hn::IfThenElse(better, found, key), d, key_ + i);
      hn::Store(hn::IfThenElse(better, hn::Set(d, x), hn::Load(d, target_x_ + i)), d, target_x_ + i);
      hn::Store(hn::IfThenElse(better, hn::Set(d, y), hn::Load(d, target_y_ + i)), d, target_y_ + i);
    }
    if (improved) update_limits();
  }

  /// The same where a pair's key is more than its distance and heights.
  HWY_NOINLINE void evaluate_pairs(int x, int y, float top) {
    const ConeMetric& metric = search_.metric;
    for (std::size_t i = 0; i < kLanes; ++i) {
      const double rise = static_cast<double>(top) - height_d_[i];
      if (rise <= 0) continue;
      const double dx = offset(x - x_d_[i], width_);
      const double dy = offset(y - y_d_[i], height_);
      const double distance2 = dx * dx * metric.weight_x + dy * dy * metric.weight_y - metric.slack;
      if (distance2 / (rise * rise) >= key_[i]) continue;
      const double found = (*search_.pair_key)({.x = x_d_[i],
                                                .y = y_d_[i],
                                                .dx = dx,
                                                .dy = dy,
                                                .distance2 = distance2,
                                                .height = height_d_[i],
                                                .target_height = static_cast<double>(top),
                                                .best = key_[i]});
      if (found >= key_[i]) continue;
      key_[i] = found;
      target_x_[i] = x;
      target_y_[i] = y;
      limit_[i] = static_cast<float>(found / metric.weight_y) * kMargin;
    }
  }

  /// Under repeat, the offset to the nearest image, in (-side/2, side/2].
  static double offset(double d, int side) {
    if constexpr (kSpace != Space::torus) return d;
    if (2 * d > side) return d - side;
    return 2 * d <= -side ? d + side : d;
  }

  void update_limits() {
    for (std::size_t i = 0; i < kLanes; ++i) {
      limit_[i] = static_cast<float>(key_[i] / search_.metric.weight_y) * kMargin;
    }
  }

  const ConeSearch& search_;
  const MaxPyramid* pyramid_ = nullptr;
  const ConeView* view_ = nullptr;
  int width_;
  int height_;
  double widest_ = 0;  // max_ratio in units of the metric
  float aspect_ = 1;   // metric in units of weight_y
  float slack_ = 0;
  float centre_x_ = 0;
  float centre_y_ = 0;
  float lowest_ = 0;  // of the lanes' heights
  HWY_ALIGN float x_[kLanes], y_[kLanes], height_f_[kLanes];
  HWY_ALIGN float limit_[kLanes];  // key in units of weight_y, rounded up
  HWY_ALIGN double x_d_[kLanes], y_d_[kLanes], height_d_[kLanes], key_[kLanes];
  HWY_ALIGN double target_x_[kLanes], target_y_[kLanes];
  // NOLINTEND(cppcoreguidelines-pro-type-member-init)
};

/// One view, or all texels, and the packets' targets in it: those of neighbours are good first guesses.
struct Look {
  const MaxPyramid* pyramid;
  const ConeView* view;
  std::array<Place, kSide> left{};
  std::vector<std::array<Place, kSide>> above{};
};

template <Space kSpace>
void seed(Packet<kSpace>& packet, const Look& look, const ConeSearch& search, Place first, bool has_above) {
  const auto place = [&](int i, int side) {
    return kSpace == Space::view && search.wrap == Wrap::repeat ? i : wrapped(i, side, search.wrap);
  };
  for (int j = -1; j <= kSide; ++j) {
    for (int i = -1; i <= kSide; ++i) {
      packet.try_texel({.x = place(first.x + i, search.heights.width), .y = place(first.y + j, search.heights.height)});
    }
  }
  for (int i = 0; i < kSide; ++i) {
    if (first.x > 0) packet.try_texel(look.left[i]);
    if (has_above) packet.try_texel(look.above[static_cast<std::size_t>(first.x / kSide)][i]);
  }
}

template <Space kSpace>
void search_images(Packet<kSpace>& packet, const ConeSearch& search) {
  // Within a view the nearest image of a texel is at most two tiles away: one where the owner is in the next tile, and
  // one more where a sector narrows to less than the offset across it.
  const bool is_tiled = kSpace == Space::view && search.wrap == Wrap::repeat;
  for (const int j : {0, 1, -1, 2, -2}) {
    for (const int i : {0, 1, -1, 2, -2}) {
      if (!is_tiled && (i != 0 || j != 0)) continue;
      packet.search_image({.x = i * search.heights.width, .y = j * search.heights.height});
    }
  }
}

template <Space kSpace>
void search_band(const ConeSearch& search, std::vector<Look> looks, int first_row, float* ratios) {
  const int width = search.heights.width;
  const int height = search.heights.height;
  const int packets = (width + kSide - 1) / kSide;
  for (Look& look : looks) look.above.resize(static_cast<std::size_t>(packets));
  Packet<kSpace> packet(search);
  for (int y = first_row; y < std::min(first_row + kBand, height); y += kSide) {
    for (int p = 0; p < packets; ++p) {
      const int x = p * kSide;
      packet.start(x, y);
      for (Look& look : looks) {
        packet.look(*look.pyramid, look.view);
        seed(packet, look, search, {.x = x, .y = y}, y > first_row);
        search_images(packet, search);
        for (int i = 0; i < kSide; ++i) {
          look.left[i] = packet.target(i * kSide + kSide - 1);
          look.above[static_cast<std::size_t>(p)][i] = packet.target(kSide * (kSide - 1) + i);
        }
      }
      for (int i = 0; i < kSide * kSide; ++i) {
        const int px = x + i % kSide;
        const int py = y + i / kSide;
        if (px < width && py < height) ratios[static_cast<std::size_t>(py) * width + px] = packet.ratio(i);
      }
    }
  }
}

void search_all_bands(const ConeSearch& search, const std::vector<MaxPyramid>& pyramids, float* ratios) {
  std::vector<Look> looks;
  for (std::size_t i = 0; i < pyramids.size(); ++i) {
    looks.push_back({.pyramid = &pyramids[i], .view = search.views.empty() ? nullptr : &search.views[i]});
  }
  const int bands = (search.heights.height + kBand - 1) / kBand;
  parallel_for(bands, search.threads, [&](int band) {
    if (!search.views.empty()) {
      search_band<Space::view>(search, looks, band * kBand, ratios);
    } else if (search.wrap == Wrap::repeat) {
      search_band<Space::torus>(search, looks, band * kBand, ratios);
    } else {
      search_band<Space::plane>(search, looks, band * kBand, ratios);
    }
  });
}

}  // namespace HWY_NAMESPACE
}  // namespace reliefbench
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace reliefbench {
HWY_EXPORT(search_all_bands);

std::vector<float> search_cones(const ConeSearch& search) {
  std::vector<MaxPyramid> pyramids;
  for (const ConeView& view : search.views) pyramids.emplace_back(*view.candidates);
  if (pyramids.empty()) pyramids.emplace_back(search.heights);
  std::vector<float> ratios(search.heights.texels.size());
  HWY_DYNAMIC_DISPATCH(search_all_bands)(search, pyramids, ratios.data());
  return ratios;
}

}  // namespace reliefbench
#endif
