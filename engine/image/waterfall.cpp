#include <ensonify/engine/image/waterfall.h>

#include <algorithm>
#include <stdexcept>

#include <ensonify/engine/sonar/instrument/mounting.h>

namespace ensonify::engine {

PingRow row_of_beam(PingRow ping, const Sonar& sonar, int beam) {
  const double vehicle_z_m = ping.pose.position.z();
  for (Pose* pose : {&ping.pose, &ping.reported})
    pose->position +=
        sonar.beam_offset_m(beam) * body_to_world(mounted(*pose, sonar.mounting)).col(0);
  ping.altitude_m += ping.pose.position.z() - vehicle_z_m;
  return ping;
}

Waterfall::Waterfall(const Sonar& its_sonar, std::size_t ping_count, std::size_t first_ping)
    : sonar(its_sonar), pings(ping_count * static_cast<std::size_t>(sonar.beams)) {
  std::size_t number = first_ping * static_cast<std::size_t>(sonar.beams);
  for (PingRow& row : pings) row.number = number++;
  pixels.assign(rows() * columns());
}

double Waterfall::sonar_altitude_m(std::size_t row) const {
  const PingRow& ping = pings[row];
  return ping.altitude_m +
         (mounted(ping.pose, sonar.mounting).position.z() - ping.pose.position.z());
}

void Waterfall::set_row(std::size_t row, std::span<const EchoLine> sides, const PingRow& record) {
  if (row >= rows()) throw std::invalid_argument("Waterfall: the row is beyond the last one");
  const auto bins = static_cast<std::ptrdiff_t>(sonar.bins);
  for (const EchoLine& side : sides) {
    const std::span<const Side> its_sides = sides_of(sonar);
    const auto sector =
        static_cast<std::size_t>(std::ranges::find(its_sides, side.side) - its_sides.begin());
    if (sector == its_sides.size())
      throw std::invalid_argument("Waterfall: the sonar does not have the echo line's side");
    BinLayers::for_each([&](std::string_view, auto layer) {
      const auto& from = side.bins.*layer;
      if (std::ssize(from) != bins)
        throw std::invalid_argument("Waterfall: the echo line's bins are not the sonar's");
      layout().set(sector, from,
                   (pixels.*layer).begin() + static_cast<std::ptrdiff_t>(row * columns()));
    });
  }
  PingRow& row_record = pings[row];
  const std::size_t number = row_record.number;
  row_record = record;
  row_record.number = number;
  for (const EchoLine& side : sides) {
    const bool port = side.side == Side::port;
    (port ? row_record.first_return_port : row_record.first_return_starboard) = side.first_return;
    (port ? row_record.starved_port : row_record.starved_starboard) = side.starved;
    row_record.gain[static_cast<std::size_t>(side.side)] = double(side.gain);
    row_record.artefacts.add(side.artefacts);
  }
}

std::span<const EchoLine> Waterfall::set_ping(std::size_t ping, std::span<const EchoLine> lines,
                                              const PingRow& record) {
  const std::size_t sides = lines.empty() ? 0 : sides_of(sonar).size();
  for (int beam = 0; beam < sonar.beams; ++beam) {
    const std::size_t row =
        ping * static_cast<std::size_t>(sonar.beams) + static_cast<std::size_t>(beam);
    set_row(row, lines.first(sides), row_of_beam(record, sonar, beam));
    lines = lines.subspan(sides);
  }
  return lines;
}

}  // namespace ensonify::engine
