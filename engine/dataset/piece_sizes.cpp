#include <ensonify/engine/dataset/piece_sizes.h>

#include <algorithm>
#include <stdexcept>
#include <string_view>
#include <vector>

#include <fmt/format.h>

#include <ensonify/engine/scene/checks/check.h>
#include <ensonify/engine/scene_error.h>
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

/// The sound speed that converts time to range, if the scene gives it.
std::optional<double> given_sound_speed_mps(const Scene& scene) {
  return scene.sea.profile.name.empty() ? scene.sea.sound_speed_mps : std::nullopt;
}

/// The vehicle at each ping of a generated track, at height 0.
std::vector<Pose> flat_track(const Scene& scene, double interval_s) {
  check_pings(scene, generated_pings(scene.track, interval_s), "track");
  // With one beam, its attitude does not matter for the places of rows.
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
  // If it is not known, nothing below depends on it.
  const double speed_mps = sound_speed_mps.value_or(scatter::nominal_sound_speed_mps);
  const std::vector<Pose> poses = flat_track(scene, scene.ping_interval_s(speed_mps));
  for (const Sonar& sonar : scene.sonars) {
    if (sonar.sample_rate_hz > 0.0 && !sound_speed_mps) continue;
    const Waterfall line = bare_line(sonar.sampled(speed_mps), poses);
    std::vector<ViewSize> views;
    try {
      if (known.slant) views.push_back(slant_size(line));
      if (known.ground_px_m > 0.0) views.push_back(ground_size(line, known.ground_px_m));
      for (const ViewSize& view : views) {
        tile_size(known.tiles, view);
        chip_size(known.chips, view);
      }
    } catch (const std::invalid_argument& error) {
      throw SceneError(error.what());
    }
  }
}

}  // namespace ensonify::engine
