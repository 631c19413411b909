#pragma once

#include <optional>
#include <string>
#include <vector>

#include <ensonify/engine/recording/recorded_line.h>

namespace ensonify::engine {

/// The headings of a vehicle that a recorded line shows.
struct ChosenHeadings {
  /// By ping; unset: not known. If all are, the course is the heading.
  std::vector<std::optional<double>> rad;
  std::string instead;  ///< why they are not the stated ones, and what they are; empty: they are
  bool of_gyro = false;
};

/// The stated headings, unless they are 0 in every ping and course or gyro are more than 10 degrees
/// off, or they are more than 60 degrees off the course: the field is not used, or its axis is
/// another one. Then, and if most pings state none, the headings of the ship's gyro, if most pings
/// state it, and it is not more than 60 degrees off the course. Otherwise the course. It follows
/// from places that are 10 m apart; angles off it are medians over the pings.
ChosenHeadings choose_headings(const RecordedLine& line);

}  // namespace ensonify::engine
