#include <ensonify/engine/output/pings_csv.h>

#include <cmath>
#include <iterator>

#include <fmt/format.h>

#include <ensonify/engine/base/units.h>

namespace ensonify::engine {

std::string pings_csv(const Waterfall& waterfall) {
  const auto bin = [](int first_return) {
    return first_return < 0 ? std::string() : fmt::format("{}", first_return);
  };
  const auto where = [](const Pose& pose) {
    return fmt::format("{},{},{},{},{},{}", pose.position.x(), pose.position.y(), pose.position.z(),
                       pose.roll_rad / degree, pose.pitch_rad / degree,
                       compass_deg(pose.heading_rad / degree));
  };
  std::string csv =
      "ping,t_s,x_m,y_m,z_m,roll_deg,pitch_deg,heading_deg,reported_x_m,reported_y_m,reported_z_m,"
      "reported_roll_deg,reported_pitch_deg,reported_heading_deg,altitude_m,first_return_port,"
      "first_return_starboard,block,starved_port,starved_starboard,artefacts\n";
  for (const PingRow& ping : waterfall.pings) {
    // The table has the columns of both sides even if the sonar has one side.
    const LineRecord port = waterfall.line_of(ping, port_sector.name),
                     starboard = waterfall.line_of(ping, starboard_sector.name);
    fmt::format_to(std::back_inserter(csv), "{},{},{},{},{},{},{},{},{},{},{}\n", ping.number,
                   ping.pose.t_s, where(ping.pose), where(ping.reported),
                   std::isnan(ping.altitude_m) ? "" : fmt::format("{}", ping.altitude_m),
                   bin(port.first_return), bin(starboard.first_return), ping.block, port.starved,
                   starboard.starved, ping.artefacts.text());
  }
  return csv;
}

}  // namespace ensonify::engine
