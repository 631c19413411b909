#include <ensonify/engine/live/frames.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>

#include <fmt/format.h>

#include <ensonify/engine/image/picture_columns.h>
#include <ensonify/engine/sonar/instrument/mounting.h>
#include <ensonify/scatter/decibel.h>

namespace ensonify::engine {
namespace {

static_assert(std::endian::native == std::endian::little);

constexpr std::size_t rays_shown = 28;  // per side

class Writer {
 public:
  explicit Writer(FrameKind kind) {
    put(static_cast<std::uint32_t>(kind));
    put(std::uint32_t{0});
  }
  template <class T>
  void put(T value) {
    bytes_.append(reinterpret_cast<const char*>(&value), sizeof(T));
  }
  template <class T, class... Values>
  void put_as(Values... values) {
    (put(static_cast<T>(values)), ...);
  }
  template <class T>
  void put_all(std::span<const T> values) {
    bytes_.append(reinterpret_cast<const char*>(values.data()), values.size_bytes());
  }
  void put_place(const Eigen::Vector3d& place) { put_as<float>(place.x(), place.y(), place.z()); }
  void pad() { bytes_.resize((bytes_.size() + 3) / 4 * 4, '\0'); }
  std::string& bytes() { return bytes_; }
  Bytes done() {
    pad();
    const auto length = static_cast<std::uint32_t>(bytes_.size() - 8);
    std::memcpy(bytes_.data() + 4, &length, sizeof length);
    return std::make_shared<const std::string>(std::move(bytes_));
  }

 private:
  std::string bytes_;
};

/// Adds the places on the seabed of some bins, evenly spaced over the bins of each side.
void put_ray_ends(const Waterfall& row, std::vector<Eigen::Vector3f>& ends) {
  const std::size_t columns = row.columns();
  const std::size_t step =
      std::max<std::size_t>(1, static_cast<std::size_t>(row.sonar.bins) / rays_shown);
  for (std::size_t column = step / 2; column < columns; column += step) {
    const auto region = static_cast<Region>(row.pixels.region[column]);
    if (region != Region::seabed && region != Region::object) continue;
    ends.emplace_back(row.pixels.x_m[column], row.pixels.y_m[column], row.pixels.z_m[column]);
  }
}

}  // namespace

Bytes json_frame(FrameKind kind, std::string_view json) {
  Writer writer(kind);
  writer.bytes() += json;
  while (writer.bytes().size() % 4 != 0) writer.bytes() += ' ';
  return writer.done();
}

Bytes gap_frame(std::uint64_t first, std::uint64_t count) {
  return json_frame(FrameKind::gap, fmt::format(R"({{"first":{},"count":{}}})", first, count));
}

std::uint16_t level_number(float level) {
  if (!(level > 0.0f)) return 0;
  const double steps = std::round(256.0 * scatter::to_db(level)) + 32768.0;
  return static_cast<std::uint16_t>(std::clamp(steps, 1.0, 65535.0));
}

std::shared_ptr<LiveLine> make_line(const Waterfall& row, const Renderer& renderer,
                                    const Picture& brightness, std::uint64_t ping,
                                    std::size_t sonar, std::uint64_t number) {
  const PingRow& record = row.pings.front();
  const std::size_t columns = row.columns();
  const BinLayers& pixels = row.pixels;
  Writer writer(FrameKind::line);
  writer.put(number);
  writer.put_as<std::uint32_t>(ping, sonar, columns, record.artefacts.has(Artefact::lost) ? 1 : 0);
  writer.put_place(record.pose.position);
  writer.put_as<float>(record.pose.heading_rad, record.pose.pitch_rad, record.pose.roll_rad,
                       record.altitude_m, record.pose.t_s);
  for (const Sector& sector : sidescan_sectors)
    writer.put_as<std::int32_t>(row.line_of(record, sector.name).first_return);
  std::vector<float> levels(columns);
  renderer.levels(row, 0, levels);
  for (const float level : levels) writer.put(level_number(level));
  writer.put_all(std::span(brightness.pixels));
  for (const std::uint32_t region : pixels.region) writer.put_as<std::uint8_t>(region);
  for (const std::uint32_t id : pixels.class_id) writer.put_as<std::uint8_t>(std::min(id, 255u));
  writer.pad();
  std::vector<Eigen::Vector3f> ends;
  put_ray_ends(row, ends);
  writer.put_as<std::uint32_t>(ends.size());
  for (const Eigen::Vector3f& end : ends) writer.put_place(end.cast<double>());
  const Pose sonar_pose = mounted(record.pose, row.sonar.mounting);
  for (int k = 0; k < 3; ++k) writer.put(sonar_pose.position[k]);
  writer.put(sonar_pose.heading_rad);
  writer.put(height_over_bed_m(row, 0));

  auto line = std::make_shared<LiveLine>();
  line->number = number;
  line->truth.resize(columns);
  for (std::size_t i = 0; i < columns; ++i)
    line->truth[i] = {.x_m = pixels.x_m[i],
                      .y_m = pixels.y_m[i],
                      .z_m = pixels.z_m[i],
                      .grazing_rad = pixels.grazing_rad[i],
                      .sediment = static_cast<std::uint16_t>(pixels.sediment[i]),
                      .class_id = static_cast<std::uint16_t>(pixels.class_id[i]),
                      .instance = static_cast<std::uint16_t>(pixels.instance[i]),
                      .shadow_instance = static_cast<std::uint16_t>(pixels.shadow_instance[i]),
                      .region = static_cast<std::uint8_t>(pixels.region[i])};
  line->frame = writer.done();
  return line;
}

Bytes mesh_frame(const MeshPatch& patch) {
  Writer writer(FrameKind::mesh);
  writer.put_as<std::uint32_t>(patch.exact.size());
  writer.put_place(patch.middle);
  writer.put_as<float>(patch.step_m);
  writer.put_all(std::span(patch.corners));
  writer.put_all(std::span(patch.exact));
  return writer.done();
}

Bytes bed_frame(const BedMap& map) {
  Writer writer(FrameKind::bed);
  writer.put_as<std::uint32_t>(map.columns, map.rows);
  writer.put_as<float>(map.lowest.x(), map.lowest.y(), map.highest.x(), map.highest.y());
  writer.put_all(std::span(map.heights_m));
  writer.put_as<std::uint32_t>(map.track.size());
  for (const Eigen::Vector2f& place : map.track) writer.put_as<float>(place.x(), place.y());
  return writer.done();
}

}  // namespace ensonify::engine
