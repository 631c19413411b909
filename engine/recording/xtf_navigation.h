#pragma once

#include <string_view>

#include <ensonify/engine/recording/line_builder.h>
#include <ensonify/engine/recording/recorded_line.h>
#include <ensonify/engine/recording/recording_bytes.h>

namespace ensonify::engine {

/// The sound speed in the header of an XTF's ping; 0: not stated.
double xtf_sound_speed_mps(const RecordingBytes& ping);

/// A ping as its header states it, without samples. `geographic`: the file states that places are
/// longitudes and latitudes; those that cannot be are kept as metres for settle_units(). Impossible
/// values are counted in `lines`.
RecordedPing xtf_ping(const RecordingBytes& header, bool geographic, LineBuilder& lines);

/// Takes the places of a whole line for degrees or metres, whatever its file states, where they can
/// only be that. Those that are neither are left out. Adds a warning in each case.
void settle_units(RecordedLine& line, bool geographic, std::string_view name);

}  // namespace ensonify::engine
