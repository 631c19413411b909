#pragma once

#include <cstddef>
#include <optional>
#include <string_view>

#include <ensonify/engine/dataset/labelled_image.h>
#include <ensonify/engine/scene/keys/dataset_options.h>
#include <ensonify/engine/scene/scene.h>

namespace ensonify::engine {

/// The size of a piece of a line.
struct PieceSize {
  std::size_t columns = 0, rows = 0;
};

/// The size of the tiles of a line; none without tiles. Throws std::invalid_argument if they are
/// larger than the line, and as pixels_of().
std::optional<PieceSize> tile_size(const TileOptions& tiles, const ViewSize& line);
/// The same for chips; none without chips, and for those whose size follows from their target.
std::optional<PieceSize> chip_size(const ChipOptions& chips, const ViewSize& line);

/// Throws SceneError if a line of a scene is smaller than its tiles or chips, as far as the scene
/// alone tells the line's size: not for a track from a file, nor where bins or pings depend on a
/// sound speed that the scene does not give.
void require_lines_for_pieces(const DatasetOptions& options, const Scene& scene);

/// Chips about objects that a scene will have.
struct ChipForecast {
  std::size_t chips = 0;
  std::size_t without_target = 0;  ///< those that show less of it than DatasetOptions::min_visible
};
/// Estimates these chips by the sizes of chips and objects, seen from above, as far as the scene
/// alone tells both: as require_lines_for_pieces(), and not for chips whose size follows from their
/// target, meshes without a length, and what is laid along a path. Throws as
/// require_lines_for_pieces().
ChipForecast forecast_chips(const DatasetOptions& options, const Scene& scene);

/// What to do if chips do not show their targets, for a message.
inline constexpr std::string_view larger_chips =
    "make chips larger (dataset.chips.size_px or size_m), or let their size follow from the target "
    "(dataset.chips.margin)";

}  // namespace ensonify::engine
