#pragma once

#include <algorithm>
#include <cstddef>
#include <span>

#include <ensonify/engine/sonar/instrument/sonar.h>

namespace ensonify::engine {

/// How the lines of a ping lie in a row of a picture: the sectors of the sonar next to each other.
/// The bins of a sector to port are in order from far to near, those of another sector from near to
/// far. Only this class defines the order of columns.
class LineLayout {
 public:
  /// A column of the picture as the sector's place in Sonar::sectors(), and the number of the bin
  /// in this sector, counted from near to far.
  struct Place {
    std::size_t sector = 0, bin = 0;
  };

  /// A picture with one column for each bin of the sonar.
  explicit LineLayout(const Sonar& sonar)
      : LineLayout(sonar.sectors(), static_cast<std::size_t>(sonar.bins)) {}
  /// A picture with `bins` columns for each sector.
  LineLayout(std::span<const Sector> sectors, std::size_t bins) : sectors_(sectors), bins_(bins) {}
  LineLayout(Sides sides, std::size_t bins) : LineLayout(sectors_of(sides), bins) {}

  std::size_t sectors() const { return sectors_.size(); }
  std::size_t bins() const { return bins_; }
  std::size_t columns() const { return sectors() * bins_; }
  bool mirrored(std::size_t sector) const { return sectors_[sector].out < 0.0; }
  std::size_t first_column(std::size_t sector) const { return sector * bins_; }

  Place place(std::size_t column) const {
    const std::size_t sector = column / bins_, at = column - sector * bins_;
    return {sector, mirrored(sector) ? bins_ - 1 - at : at};
  }
  std::size_t column(Place place) const {
    return first_column(place.sector) +
           (mirrored(place.sector) ? bins_ - 1 - place.bin : place.bin);
  }
  /// set() copies a line, whose bins are from near to far, to its columns in a row; get() copies
  /// these columns to a line.
  template <class Line, class Row>
  void set(std::size_t sector, const Line& line, Row row) const {
    const Row columns = row + static_cast<std::ptrdiff_t>(first_column(sector));
    if (mirrored(sector))
      std::reverse_copy(line.begin(), line.end(), columns);
    else
      std::copy(line.begin(), line.end(), columns);
  }
  template <class Row, class Line>
  void get(std::size_t sector, Row row, Line line) const {
    const Row columns = row + static_cast<std::ptrdiff_t>(first_column(sector));
    const Row end = columns + static_cast<std::ptrdiff_t>(bins_);
    if (mirrored(sector))
      std::reverse_copy(columns, end, line);
    else
      std::copy(columns, end, line);
  }

 private:
  std::span<const Sector> sectors_;
  std::size_t bins_;
};

}  // namespace ensonify::engine
