#include <ensonify/engine/image/waterfall.h>

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

LineRecord Waterfall::line_of(const PingRow& row, std::string_view sector) const {
  const std::optional<std::size_t> place = place_of(sonar.sectors(), sector);
  return place ? row.lines[*place] : LineRecord{};
}

void Waterfall::set_row(std::size_t row, std::span<const EchoLine> lines, const PingRow& record) {
  if (row >= rows()) throw std::invalid_argument("Waterfall: the row is beyond the last one");
  const auto bins = static_cast<std::ptrdiff_t>(sonar.bins);
  for (const EchoLine& line : lines) {
    if (line.sector >= sonar.sectors().size())
      throw std::invalid_argument("Waterfall: the sonar does not have the echo line's sector");
    BinLayers::for_each([&](std::string_view, auto layer) {
      const auto& from = line.bins.*layer;
      if (std::ssize(from) != bins)
        throw std::invalid_argument("Waterfall: the echo line's bins are not the sonar's");
      layout().set(line.sector, from,
                   (pixels.*layer).begin() + static_cast<std::ptrdiff_t>(row * columns()));
    });
  }
  PingRow& row_record = pings[row];
  const std::size_t number = row_record.number;
  row_record = record;
  row_record.number = number;
  for (const EchoLine& line : lines) {
    row_record.lines[line.sector] = {
        .first_return = line.first_return, .starved = line.starved, .gain = double(line.gain)};
    row_record.artefacts.add(line.artefacts);
  }
}

std::span<const EchoLine> Waterfall::set_ping(std::size_t ping, std::span<const EchoLine> lines,
                                              const PingRow& record) {
  const std::size_t sectors = lines.empty() ? 0 : sonar.sectors().size();
  for (int beam = 0; beam < sonar.beams; ++beam) {
    const std::size_t row =
        ping * static_cast<std::size_t>(sonar.beams) + static_cast<std::size_t>(beam);
    set_row(row, lines.first(sectors), row_of_beam(record, sonar, beam));
    lines = lines.subspan(sectors);
  }
  return lines;
}

}  // namespace ensonify::engine
