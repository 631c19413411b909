#pragma once

#include <string_view>

#include <ensonify/engine/recording/line_builder.h>
#include <ensonify/engine/recording/recorded_line.h>
#include <ensonify/engine/recording/recording_bytes.h>

namespace ensonify::engine {

/// The sound speed in the header of an XTF's ping; 0: not stated.
double xtf_sound_speed_mps(const RecordingBytes& ping);

/// The ping that a ping header states, without samples. If `geographic`, the file states that
/// places are longitudes and latitudes; places that cannot be are kept as metres for
/// settle_units(). Impossible values are counted in `lines`.
RecordedPing xtf_ping(const RecordingBytes& header, bool geographic, LineBuilder& lines);

/// Corrects the unit of a line's places: degrees if the file states metres but the places can only
/// be degrees, and metres if the file states degrees (`geographic`) but the places can only be
/// metres. Places that can be neither are left out. Adds a warning in each case.
void settle_units(RecordedLine& line, bool geographic, std::string_view name);

/// For pings that have a layback, the places are those of the ship. This moves them to the towed
/// sonar: to the place on the ship's track whose distance from the ship is the layback. The track
/// is continued backwards in a straight line before the first ping. Adds a warning. If the ship
/// does not move, the places stay, the laybacks are removed, and the warning says so.
void tow_back(RecordedLine& line, std::string_view name);

}  // namespace ensonify::engine
