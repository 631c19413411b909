#pragma once

#include <array>
#include <span>
#include <string_view>
#include <vector>

#include <ensonify/engine/image/line_layout.h>
#include <ensonify/engine/sonar/echo/echo.h>
#include <ensonify/engine/sonar/vehicle/track.h>

namespace ensonify::engine {

/// Data of one line of a row, as in EchoLine.
struct LineRecord {
  int first_return = -1, starved = 0;
  double gain = 1.0;
};

/// One row of the pings file.
struct PingRow {
  std::size_t number = 0;   ///< counted over the rows of the whole run, as files number pings
  Pose pose;                ///< the vehicle's true pose
  Pose reported;            ///< the pose that its navigation reports
  double altitude_m = 0.0;  ///< of the vehicle above the bed straight below; NaN over a hole
  int block = 0;
  Artefacts artefacts;
  std::array<LineRecord, most_sectors> lines;  ///< by sector
  bool recorded = true;     ///< false: nothing was recorded, and the row is empty
  double interval_s = 0.0;  ///< time to the nearer of the neighbouring pings; 0 if there is none
};

/// The row of one beam of a sonar, from 0 (the rear beam) to Sonar::beams - 1. The poses of `ping`
/// are moved along the array by the offset of the beam.
PingRow row_of_beam(PingRow ping, const Sonar& sonar, int beam);

/// Stacked echo lines of one sonar: one row per ping and beam, the oldest ping first, and within a
/// ping the rear beam first. Files number rows as pings. LineLayout has the order of columns.
struct Waterfall {
  Sonar sonar;
  BinLayers pixels;            ///< rows() * columns() values per layer
  std::vector<PingRow> pings;  ///< the rows

  /// Room for `ping_count` pings, of which the first is the run's ping `first_ping`. The rows are
  /// numbered, all other values are 0. The sonar must have bins (Sonar::sampled()).
  Waterfall(const Sonar& its_sonar, std::size_t ping_count, std::size_t first_ping = 0);
  std::size_t rows() const { return pings.size(); }
  LineLayout layout() const { return LineLayout(sonar); }
  std::size_t columns() const { return layout().columns(); }
  /// The height (m) of the sonar over the bed at a row's ping, with the bed taken as level: the
  /// vehicle's altitude minus the distance by which the sonar, with its mounting and the vehicle's
  /// attitude, is below the vehicle. NaN over a hole.
  double sonar_altitude_m(std::size_t row) const;
  /// A row's data of the line of a sector, by its name; LineRecord{} if the sonar does not have it.
  LineRecord line_of(const PingRow& row, std::string_view sector) const;
  /// Sets a row. Its pixels come from the echo lines of its sectors; a lost ping has no lines. Each
  /// line also gives its LineRecord, and adds its artefacts. All other values come from `record`,
  /// but the row keeps its number. Several threads may set different rows at once. Throws
  /// std::invalid_argument for a row that is not there, a sector that the sonar does not have, and
  /// lines with another number of bins.
  void set_row(std::size_t row, std::span<const EchoLine> lines, const PingRow& record);
  /// Sets the rows of a ping, counted from 0 in this waterfall. `lines` are in the order of
  /// Simulator::ping(): the lines of this sonar's beams (sectors * beams), and perhaps lines of
  /// further sonars; empty for a lost ping. Returns the lines after those of this sonar. Throws as
  /// set_row().
  std::span<const EchoLine> set_ping(std::size_t ping, std::span<const EchoLine> lines,
                                     const PingRow& record);
};

}  // namespace ensonify::engine
