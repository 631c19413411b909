#include <ensonify/engine/dataset/piece_sizes.h>

#include <algorithm>
#include <stdexcept>
#include <vector>

#include <Eigen/Geometry>
#include <fmt/format.h>

#include <ensonify/engine/base/scene_error.h>
#include <ensonify/engine/scene/checks/check.h>
#include <ensonify/engine/seafloor/objects/objects.h>
#include <ensonify/engine/seafloor/objects/shapes.h>
#include <ensonify/engine/sonar/vehicle/ground_path.h>
#include <ensonify/engine/sonar/vehicle/motion.h>
#include <ensonify/scatter/sea_water.h>

namespace ensonify::engine {
namespace {

PieceSize fitting(std::string_view key, const PieceSize& piece, const ViewSize& line) {
  if (piece.columns > line.columns || piece.rows > line.rows)
    throw std::invalid_argument(
        fmt::format("'{}' needs {} x {} pixels, but {} has {} x {}; make the tiles or chips "
                    "smaller or the line longer",
                    key, piece.columns, piece.rows, line.name, line.columns, line.rows));
  return piece;
}

/// The sound speed that converts time to range; none if the scene does not give it.
std::optional<double> given_sound_speed_mps(const Scene& scene) {
  return scene.sea.profile.name.empty() ? scene.sea.sound_speed_mps : std::nullopt;
}

/// The vehicle at each ping of a generated track, at height 0.
std::vector<Pose> flat_track(const Scene& scene, double interval_s) {
  check_pings(scene, generated_pings(scene.track, interval_s), "track");
  // With one beam, the places of rows do not depend on the vehicle's attitude.
  MotionOptions moves = scene.motion;
  if (std::ranges::all_of(scene.sonars, [](const Sonar& sonar) { return sonar.beams == 1; }))
    moves = {.sway = moves.sway, .surge = moves.surge, .speed = moves.speed};
  const Motion motion(moves, scene.seed);
  std::vector<Pose> poses = generate_pings(scene.track, interval_s, motion.speed()).poses;
  for (Pose& pose : poses) pose = motion.applied_to(pose);
  return poses;
}

/// A sonar's line without its pixels, from the vehicle's poses.
Waterfall bare_line(const Sonar& sonar, const std::vector<Pose>& poses) {
  Waterfall line(sonar, 0);
  for (const Pose& pose : poses)
    for (int beam = 0; beam < sonar.beams; ++beam)
      line.pings.push_back(row_of_beam({.pose = pose}, sonar, beam));
  return line;
}

/// Calls f(known, view, heading_rad) for each view of a scene's lines whose size is known from the
/// scene alone. `known` are the options without the pieces whose sizes are not known in this way,
/// `heading_rad` is the vehicle's first heading. Throws SceneError if a view cannot be made.
template <class F>
void for_each_known_view(const DatasetOptions& options, const Scene& scene, const F& f) {
  const TrackOptions& track = scene.track;
  const std::optional<double> sound_speed_mps = given_sound_speed_mps(scene);
  const bool knows_interval = track.ping_interval_s > 0.0 || sound_speed_mps;
  DatasetOptions known = options;
  if (!knows_interval) {  // nor lengths along the track
    known.ground_px_m = 0.0;
    if (known.tiles.width_m > 0.0) known.tiles = {};
    if (known.chips.size_m > 0.0) known.chips = {};
  }
  if (!known.tiles.any() && (!known.chips.any() || !known.chips.margin.empty())) return;
  const bool moves = track.speed_mps > 0.0;
  if (track.kind == TrackKind::file ||
      (track.kind == TrackKind::lawn_mower && !(knows_interval && moves)))
    return;
  // If the sound speed is not known, nothing below depends on it.
  const double speed_mps = sound_speed_mps.value_or(scatter::nominal_sound_speed_mps);
  const std::vector<Pose> poses = flat_track(scene, scene.ping_interval_s(speed_mps));
  for (const Sonar& sonar : scene.sonars) {
    if (sonar.steers() || (sonar.sample_rate_hz > 0.0 && !sound_speed_mps)) continue;
    const Waterfall line = bare_line(sonar.sampled(speed_mps), poses);
    std::vector<ViewSize> views;
    try {
      if (known.slant) views.push_back(slant_size(line));
      if (known.ground_px_m > 0.0) views.push_back(ground_size(line, known.ground_px_m));
    } catch (const std::invalid_argument& error) {
      throw SceneError(error.what());
    }
    for (const ViewSize& view : views) f(known, view, poses.front().heading_rad);
  }
}

/// Length and width of an object seen from above, if its table gives a length; none for an object
/// along a path. The width is 0 if it is not given.
std::optional<Eigen::Vector2d> size_from_above_m(const ObjectOptions& object) {
  Eigen::Vector2d size_m(object.size.length_m.value_or(0.0), 0.0);
  if (!object.shape.empty()) {
    const ShapeKind& kind = shape_named(object.shape);
    if (kind.along_path) return std::nullopt;
    const auto given_m = [&](std::optional<double> ShapeSize::*which) {
      const bool has_it = std::ranges::count(kind.dimensions, which, &Dimension::size) > 0;
      return has_it ? kind.size_m(object.size, which) : 0.0;
    };
    const double diameter_m = given_m(&ShapeSize::diameter_m);
    size_m = {std::max(diameter_m, given_m(&ShapeSize::length_m)),
              std::max(diameter_m, given_m(&ShapeSize::width_m))};
  }
  if (!(size_m.x() > 0.0)) return std::nullopt;
  return size_m * (object.shape.empty() ? 1.0 : object.scale);
}

/// The share of a rectangle that lies in a chip with the same middle. `rectangle_m`: length and
/// width; `turned_rad`: angle between its length and the track; `chip_m`: size of the chip across
/// and along the track.
double share_within(const Eigen::Vector2d& rectangle_m, double turned_rad,
                    const Eigen::Vector2d& chip_m) {
  constexpr int steps = 64;
  const Eigen::Rotation2Dd turn(-turned_rad);  // clockwise
  int inside = 0;
  for (int i = 0; i < steps; ++i)
    for (int j = 0; j < steps; ++j) {
      const Eigen::Vector2d share((i + 0.5) / steps - 0.5, (j + 0.5) / steps - 0.5);
      const Eigen::Vector2d place_m =
          turn * Eigen::Vector2d(share.x() * rectangle_m.y(), share.y() * rectangle_m.x());
      inside += (place_m.cwiseAbs().array() <= 0.5 * chip_m.array()).all();
    }
  return inside / static_cast<double>(steps * steps);
}

}  // namespace

std::optional<PieceSize> tile_size(const TileOptions& tiles, const ViewSize& line) {
  if (!tiles.any()) return std::nullopt;
  const PieceSize tile = tiles.width_px > 0 ? PieceSize{pixels_of(tiles.width_px, 1.0),
                                                        pixels_of(tiles.height_px, 1.0)}
                                            : PieceSize{pixels_of(tiles.width_m, line.across_m),
                                                        pixels_of(tiles.height_m, line.along_m)};
  return fitting("dataset.tiles", tile, line);
}

std::optional<PieceSize> chip_size(const ChipOptions& chips, const ViewSize& line) {
  if (!chips.any() || !chips.margin.empty()) return std::nullopt;
  const PieceSize chip =
      chips.size_m > 0.0
          ? PieceSize{pixels_of(chips.size_m, line.across_m), pixels_of(chips.size_m, line.along_m)}
          : PieceSize{pixels_of(chips.size_px, 1.0), pixels_of(chips.size_px, 1.0)};
  return fitting("dataset.chips", chip, line);
}

void require_lines_for_pieces(const DatasetOptions& options, const Scene& scene) {
  for_each_known_view(options, scene,
                      [](const DatasetOptions& known, const ViewSize& view, double) {
                        try {
                          tile_size(known.tiles, view);
                          chip_size(known.chips, view);
                        } catch (const std::invalid_argument& error) {
                          throw SceneError(error.what());
                        }
                      });
}

ChipForecast forecast_chips(const DatasetOptions& options, const Scene& scene) {
  ChipForecast forecast;
  const std::vector<std::string>& chosen = options.chips.classes;
  const std::vector<std::size_t> bases = bases_of(scene.objects);
  for_each_known_view(
      options, scene, [&](const DatasetOptions& known, const ViewSize& view, double heading_rad) {
        const std::optional<PieceSize> chip = chip_size(known.chips, view);
        if (!chip) return;
        const Eigen::Vector2d size_m(static_cast<double>(chip->columns) * view.across_m,
                                     static_cast<double>(chip->rows) * view.along_m);
        for (std::size_t t = 0; t < scene.objects.size(); ++t) {
          const ObjectOptions& object = scene.objects[t];
          const std::optional<Eigen::Vector2d> seen_m = size_from_above_m(object);
          if (bases[t] != t || !seen_m || object.part_classes ||
              (!chosen.empty() && std::ranges::count(chosen, object.class_name) == 0))
            continue;
          const auto copies = static_cast<std::size_t>(std::max(1, object.count));
          forecast.chips += copies;
          if (share_within(*seen_m, object.heading_rad - heading_rad, size_m) < options.min_visible)
            forecast.without_target += copies;
        }
      });
  return forecast;
}

}  // namespace ensonify::engine
