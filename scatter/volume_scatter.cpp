#include <ensonify/scatter/volume_scatter.h>

#include <cmath>
#include <stdexcept>
#include <string_view>

#include <fmt/format.h>

#include <ensonify/scatter/decibel.h>

namespace ensonify::scatter {
namespace {

void check(std::string_view what, double value) {
  if (!(value > 0.0 && std::isfinite(value)))
    throw std::invalid_argument(
        fmt::format("volume scatter: {} is {}, expected more than 0", what, value));
}

}  // namespace

double insonified_volume_m3(const InsonifiedWater& water, double range_m) {
  check("range", range_m);
  check("solid angle", water.solid_angle_sr);
  check("duration of the pulse", water.pulse_s);
  check("sound speed", water.sound_speed_mps);
  return water.solid_angle_sr * range_m * range_m * 0.5 * water.sound_speed_mps * water.pulse_s;
}

double volume_reverberation_db(const InsonifiedWater& water, double source_level_db,
                               double absorption_db_per_m, double range_m) {
  return source_level_db - 40.0 * std::log10(range_m) - 2.0 * absorption_db_per_m * range_m +
         water.strength_db + to_db(insonified_volume_m3(water, range_m));
}

}  // namespace ensonify::scatter
