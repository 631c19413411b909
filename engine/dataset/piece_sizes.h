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

/// The size of the tiles of a line; none if there are no tiles. Throws std::invalid_argument if
/// they are larger than the line, and as pixels_of().
std::optional<PieceSize> tile_size(const TileOptions& tiles, const ViewSize& line);
/// The size of the chips of a line; none if there are no chips, or if the size of each follows from
/// its target. Throws as tile_size().
std::optional<PieceSize> chip_size(const ChipOptions& chips, const ViewSize& line);

/// Throws SceneError if a line of a scene is smaller than its tiles or chips. Checks only lines
/// whose size is known from the scene alone: no lines of a track from a file, and no lines whose
/// bins or pings depend on a sound speed that the scene does not give.
void require_lines_for_pieces(const DatasetOptions& options, const Scene& scene);

/// The chips of objects that a scene will have.
struct ChipForecast {
  std::size_t chips = 0;
  std::size_t without_target = 0;  ///< chips that show less than DatasetOptions::min_visible of it
};
/// Estimates these chips from the sizes of chips and of objects, seen from above. Counts only the
/// lines that require_lines_for_pieces() checks. Counts no chips whose size follows from their
/// target, no meshes without a length, and no objects along a path. Throws as
/// require_lines_for_pieces().
ChipForecast forecast_chips(const DatasetOptions& options, const Scene& scene);

/// For a message: what to do if chips do not show their targets.
inline constexpr std::string_view larger_chips =
    "make chips larger (dataset.chips.size_px or size_m), or let their size follow from the target "
    "(dataset.chips.margin)";

}  // namespace ensonify::engine
