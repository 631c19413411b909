#pragma once

#include <span>
#include <string>
#include <vector>

#include <ensonify/engine/sonar/echo/echo.h>
#include <ensonify/engine/sonar/vehicle/track.h>

namespace ensonify::engine {

/// What the pings file says of a ping, beside the image.
struct PingRow {
  Pose pose;                ///< of the vehicle
  Pose reported;            ///< what it takes that for
  double altitude_m = 0.0;  ///< over the bed straight below; NaN over a hole
  int block = 0;
  int first_return_port = -1, first_return_starboard = -1;  ///< bins
  int starved_port = 0, starved_starboard = 0;
  Artefacts artefacts;
};

/// Stacked echo lines of one sonar: a row a ping, the oldest first; columns port far..near, then
/// starboard near..far, of the sides it has.
struct Waterfall {
  Sonar sonar;
  BinLayers pixels;  ///< pings * columns() values a layer
  std::vector<PingRow> pings;

  Waterfall(const Sonar& its_sonar, std::size_t ping_count);
  std::size_t rows() const { return pings.size(); }
  std::size_t columns() const {
    return sides_of(sonar).size() * static_cast<std::size_t>(sonar.bins);
  }
  /// Puts the sides of a ping into their row, and what the record says of them from the lines.
  /// Rows may be set from several threads at once.
  void set_row(std::size_t ping, std::span<const EchoLine> sides, const PingRow& record);
};

}  // namespace ensonify::engine
