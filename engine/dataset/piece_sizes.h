#pragma once

#include <cstddef>
#include <optional>

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

}  // namespace ensonify::engine
