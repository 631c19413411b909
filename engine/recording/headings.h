#pragma once

#include <optional>
#include <string>
#include <vector>

#include <ensonify/engine/recording/recorded_line.h>

namespace ensonify::engine {

/// The headings of a vehicle that a recorded line states, or the headings that replace them.
struct ChosenHeadings {
  /// By ping; unset: unknown. If all headings are unset, the course is the heading.
  std::vector<std::optional<double>> rad;
  std::string instead;   ///< why these replace the stated headings; empty: these are stated
  bool of_gyro = false;  ///< whether these are the headings of the ship's gyro
};

/// Chooses the headings of a line. The stated headings are rejected in three cases: most pings
/// state none; they are 0 in every ping, and the course or the gyro differs from 0 by more than 10
/// degrees (then the field is not used); or they differ from the course by more than 60 degrees
/// (then the field has another axis). The ship's gyro replaces rejected headings if most pings
/// state it and it does not differ from the course by more than 60 degrees. Otherwise the course
/// replaces them. The course is the direction between places that are at least 10 m apart. All
/// differences are medians over the pings.
ChosenHeadings choose_headings(const RecordedLine& line);

}  // namespace ensonify::engine
