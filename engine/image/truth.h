#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include <Eigen/Core>

#include <ensonify/engine/image/waterfall.h>

namespace ensonify::engine {

/// A corner of pixels of the picture (display.h): [column from the left, row from the top]; the
/// newest ping is on top. Pixel (c, r) has the corners (c, r) to (c + 1, r + 1).
using Corner = std::array<int, 2>;

/// A set of pixels of the picture.
struct Outline {
  std::size_t area_px = 0;
  Corner low{}, high{};  ///< the bounding box: pixels [low, high)
  /// One polygon per part, the largest part first; a part is connected over pixel edges. A polygon
  /// is the part's outer border along pixel edges, clockwise in the picture, corners only, without
  /// the part's holes.
  std::vector<std::vector<Corner>> polygons;
  /// Only if a part has holes, which polygons cannot describe: COCO's run lengths over the whole
  /// picture, column by column from the top: pixels outside, inside, outside, and so on.
  std::vector<std::size_t> runs;
};

/// Where a picture shows one object, or one feature of the bed.
struct TargetOutlines {
  Outline body;    ///< pixels of region object or seabed with its `instance`
  Outline shadow;  ///< pixels of region shadow with its `shadow_instance`
};

/// How the sonar sees the pixels of a target. Sights in several parts of a run are added.
struct Sight {
  std::map<std::string, std::size_t> sector_px;  ///< number of pixels by the name of the sector
  /// Sum over the pixels of a unit vector (north, east): the direction from the sonar to the pixel.
  Eigen::Vector2d directions = Eigen::Vector2d::Zero();

  Sight& operator+=(const Sight& more);
  std::size_t pixels() const;
  /// The name of the sector with the most pixels; of two with equal numbers the later name.
  std::string sector() const;
  /// Mean direction, clockwise from north.
  double direction_rad() const { return std::atan2(directions.y(), directions.x()); }
};

/// What a picture shows of one object, or of one feature of the bed.
struct Target : TargetOutlines {
  std::uint32_t instance = 0;
  double range_m = 0.0;  ///< mean slant range of the body; without a body, of the shadow
  double ping = 0.0;     ///< mean ping of the same pixels, numbered as in the run
  Sight sight;           ///< of the same pixels
  /// Mean expected intensity of the body divided by the mean expected intensity of the seabed near
  /// it, in dB. The seabed near it is: pixels of region seabed without an instance, in the body's
  /// box, which is extended on each side by its size (at least 8 pixels). None if there is no body
  /// or no such seabed.
  std::optional<double> contrast_db;
};

/// Calls f for each layer that find_targets() reads.
template <class F>
void for_each_truth_layer(F&& f) {
  f(&BinLayers::intensity_mean);
  f(&BinLayers::range_m);
  f(&BinLayers::region);
  f(&BinLayers::instance);
  f(&BinLayers::shadow_instance);
}

/// By instance: all objects and features with a pixel of their body or shadow in the waterfall.
std::map<std::uint32_t, TargetOutlines> find_outlines(const Waterfall& waterfall);
std::vector<Target> find_targets(const Waterfall& waterfall);

/// The instances with a pixel of their body in a line's first or last row, or in the outermost
/// range bin of a sector. They may continue outside the line.
std::set<std::uint32_t> targets_at_edges(const Waterfall& line);

}  // namespace ensonify::engine
