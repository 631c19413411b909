#include <ensonify/engine/image/over_ground.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <stdexcept>
#include <vector>

#include <ensonify/engine/image/truth.h>

namespace ensonify::engine {

std::vector<std::ptrdiff_t> columns_over_ground(const Waterfall& waterfall, std::size_t row) {
  const auto port = static_cast<std::ptrdiff_t>(port_columns(waterfall.sonar));
  const double bin_m = waterfall.sonar.bin_m(), height_m = height_over_bed_m(waterfall, row);
  std::vector<std::ptrdiff_t> columns(waterfall.columns());
  for (std::ptrdiff_t column = 0; column < std::ssize(columns); ++column) {
    const std::ptrdiff_t from_nadir = column < port ? port - 1 - column : column - port;
    const double over_m = (static_cast<double>(from_nadir) + 0.5) * bin_m;
    const auto bin =
        static_cast<std::ptrdiff_t>(std::sqrt(over_m * over_m + height_m * height_m) / bin_m);
    columns[static_cast<std::size_t>(column)] = bin >= waterfall.sonar.bins ? -1
                                                : column < port             ? port - 1 - bin
                                                                            : port + bin;
  }
  return columns;
}

double height_over_bed_m(const Waterfall& waterfall, std::size_t row) {
  const PingRow& ping = waterfall.pings[row];
  const double altitude_m = waterfall.sonar_altitude_m(row);
  if (ping.altitude_m > 0.0 && altitude_m > 0.0) return altitude_m;
  return std::max({ping.first_return_port, ping.first_return_starboard, 0}) *
         waterfall.sonar.bin_m();
}

Picture over_ground(const Waterfall& waterfall, const Picture& picture) {
  if (picture.width != waterfall.columns() || picture.height != waterfall.rows())
    throw std::invalid_argument("over_ground: the picture's size is not the waterfall's");
  const std::ptrdiff_t pixel_bytes = picture.channels * (picture.bits / 8);
  Picture made = picture;
  std::uint8_t* to = made.pixels.data();
  for (std::size_t row = waterfall.rows(); row-- > 0;) {
    const std::uint8_t* from = picture.pixels.data() + (to - made.pixels.data());
    for (const std::ptrdiff_t column : columns_over_ground(waterfall, row)) {
      if (column < 0)
        std::fill_n(to, pixel_bytes, std::uint8_t{0});
      else
        std::copy_n(from + pixel_bytes * column, pixel_bytes, to);
      to += pixel_bytes;
    }
  }
  return made;
}

Waterfall truth_over_ground(const Waterfall& waterfall) {
  Waterfall made(waterfall.sonar, 0);
  made.pings = waterfall.pings;
  for_each_truth_layer([&](auto layer) {
    auto& to = made.pixels.*layer;
    const auto& from = waterfall.pixels.*layer;
    to.reserve(from.size());
    for (std::size_t row = 0; row < waterfall.rows(); ++row)
      for (const std::ptrdiff_t column : columns_over_ground(waterfall, row))
        to.push_back(
            column < 0 ? 0 : from[row * waterfall.columns() + static_cast<std::size_t>(column)]);
  });
  return made;
}

}  // namespace ensonify::engine
