#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include <ensonify/engine/image/display.h>

namespace ensonify::engine {

/// Draws the pings of an imaging sonar as seen from above, to scale: the sonar is at the bottom in
/// the middle, ahead is up, starboard is to the right. Outside the field of view it is black.
class FanPicture {
 public:
  /// The height is one pixel per range bin, but from 64 to `most_height`.
  explicit FanPicture(const Sonar& sonar, std::size_t most_height = 1024);

  std::size_t width() const { return width_; }
  std::size_t height() const { return height_; }
  double m_per_px() const { return m_per_px_; }
  /// The beam and bin nearest to the middle of a pixel, as beam * bins + bin; none outside the
  /// field of view and the range.
  std::optional<std::size_t> nearest(std::size_t column, std::size_t row) const;
  /// The fan of the ping with this number in the picture (Renderer::render) of a waterfall of the
  /// sonar's pings, counted from the oldest. Between beams and bins it is interpolated linearly.
  Picture draw(const Picture& waterfall, std::size_t ping) const;

 private:
  /// From where in the beams x bins of a ping a pixel comes.
  struct Source {
    float beam = -1.0f, bin = 0.0f;  ///< beam below 0: outside the field of view
  };
  std::size_t width_, height_, beams_, bins_;
  double m_per_px_;
  std::vector<Source> sources_;
};

}  // namespace ensonify::engine
