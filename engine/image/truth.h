#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include <ensonify/engine/image/waterfall.h>

namespace ensonify::engine {

/// A corner between pixels of the picture (display.h): columns from the left, rows from the top,
/// which is the newest ping. Pixel (c, r) has the corners (c, r) and (c + 1, r + 1).
using Corner = std::array<int, 2>;

/// Pixels of the picture that belong together.
struct Outline {
  std::size_t area_px = 0;
  Corner low{}, high{};  ///< the box around them: pixels [low, high)
  /// One polygon for each part that is connected by its pixels' edges, the largest part first:
  /// its outer border along the pixels' edges, clockwise as seen in the picture, corners alone, as
  /// if it had no holes.
  std::vector<std::vector<Corner>> polygons;
  /// Where a part has holes, which the polygons cannot show, all pixels of the picture: column by
  /// column, each from the top, how many there are outside, inside, outside ... in turn (COCO's run
  /// lengths). Else empty.
  std::vector<std::size_t> runs;
};

/// What a picture shows of one object, or of one feature of the bed.
struct Target {
  std::uint32_t instance = 0;
  Outline body;            ///< where `region` is object or seabed, and `instance` this
  Outline shadow;          ///< where `region` is shadow and `shadow_instance` this
  double range_m = 0.0;    ///< mean slant range of its body, or without one of its shadow
  Side side = Side::port;  ///< that most of it lies on
  double ping = 0.0;       ///< its middle
  /// Mean expected intensity of its body over that of the seabed near it, dB: the pixels of region
  /// seabed without an instance in its box grown by its own size (8 pixels at least) to every side.
  /// None without one or the other.
  std::optional<double> contrast_db;
};

/// Every object and feature of which a waterfall holds a pixel or a shadow's, by instance.
std::vector<Target> find_targets(const Waterfall& waterfall);

}  // namespace ensonify::engine
