#pragma once

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <mutex>
#include <span>
#include <string>
#include <vector>

#include <Eigen/Core>

#include <ensonify/refine/height_grid.h>

namespace ensonify::refine {

/// The tiles of a HeightGrid in a file that is mapped into memory. Tiles are made when they are
/// first needed, 16 x 16 at a time, from the heights of their points. A tile depends only on its
/// place, not on the process that makes it, the time or the order. So the file of a killed process
/// can be continued, several processes may use one file, and a tile whose checksum is wrong is made
/// again. Thread-safe.
class HeightTiles {
 public:
  static constexpr int chunk_tiles = 16;  ///< tiles that are made together, in both directions
  static constexpr int chunk_cells = chunk_tiles * HeightGrid::tile_cells;

  /// The heights (m, local; NaN for a hole) of the grid's points from (first_column, first_row) on,
  /// row by row from the south, and their kinds, which are numbers that the caller defines (empty
  /// for a grid without kinds). A point must have the same values in every call, for any window.
  /// Several threads call the function at once.
  using Heights = std::function<void(int first_column, int first_row, int columns, int rows,
                                     std::span<double> z_m, std::span<std::uint8_t> kinds)>;

  /// The kinds of a tile's points, row by row.
  using Kinds = std::array<std::uint8_t, HeightGrid::tile_points * HeightGrid::tile_points>;

  /// The description of the grid before its tiles are made.
  struct Shape {
    std::vector<float> x_m, y_m;  ///< of columns and rows
    Eigen::Vector3d world_origin = Eigen::Vector3d::Zero();
    double mean_height_m = 0.0;
    float lowest_m = 0.0f, highest_m = 0.0f;  ///< approximate; heights of tiles may be outside
  };
  /// Fills in mean, lowest and highest height of a shape whose other members are set.
  using Describe = std::function<void(Shape&)>;

  /// Opens the file, or makes it if there is none; only then is `describe` called. `key`, of at
  /// most 64 bytes, identifies what the heights are made from. Without a file name, the tiles are
  /// in memory. Throws MeshError for another file or key, std::system_error if it cannot make the
  /// file.
  HeightTiles(std::vector<float> x_m, std::vector<float> y_m, const Eigen::Vector3d& world_origin,
              const Describe& describe, Heights heights, const std::filesystem::path& file,
              const std::string& key, bool with_kinds = false);
  /// Opens a file for inspection only: require() must not be called then.
  explicit HeightTiles(const std::filesystem::path& file);
  ~HeightTiles();
  HeightTiles(const HeightTiles&) = delete;
  HeightTiles& operator=(const HeightTiles&) = delete;

  /// Whether a file begins like a file of tiles.
  static bool is_one(const std::filesystem::path& file);

  const Shape& shape() const { return shape_; }
  const std::string& key() const { return key_; }
  std::size_t tiles() const {
    return static_cast<std::size_t>(tile_columns()) * static_cast<std::size_t>(tile_rows());
  }
  /// The number of tiles that are in the file, as far as this process knows.
  std::size_t tiles_made() const { return made_.load(std::memory_order_relaxed); }
  /// The number of chunks. A chunk is the tiles that are made together.
  std::size_t chunks() const { return chunk_locks_.size(); }
  /// Bytes of the file when all tiles are made.
  std::uint64_t file_bytes() const;

  /// All tiles. The content of a tile is undefined until require() was called for it.
  std::span<const HeightGrid::Tile> mapped() const { return {tiles_, tiles()}; }
  /// The kinds of a tile's points, if the grid has kinds; undefined until require() was called for
  /// it.
  const Kinds& kinds(std::size_t tile) const { return kinds_[tile]; }
  /// Makes sure that a tile exists and is undamaged. Throws what `heights` throws, MeshError for
  /// heights that do not fit a float, and std::system_error if the file cannot be written.
  void require(std::size_t tile) {
    if (states_[tile].load(std::memory_order_acquire) != State::checked) check_or_make(tile);
  }
  /// Does this for all tiles of a chunk.
  void require_chunk(std::size_t chunk);
  /// The range of a tile's heights; not_known() if the tile was not made.
  HeightGrid::Range range(std::size_t tile) const {
    return states_[tile].load(std::memory_order_acquire) == State::absent
               ? HeightGrid::Range::not_known()
               : entries_[tile].range;
  }
  std::vector<HeightGrid::Range> ranges() const;  ///< of all tiles

 private:
  enum class State : std::uint8_t {
    absent,
    there,   // in the file, not checked yet
    checked  // its checksum is right
  };
  /// A tile's entry in the file's table; zeros: the tile was not made.
  struct Entry {
    std::uint64_t checksum = 0;  // of the tile and its kinds
    HeightGrid::Range range;
    std::uint64_t check = 0;  // checksum of the members above and of the tile's number
  };
  struct Header;
  struct Layout;
  HeightTiles() = default;
  Layout layout() const;

  void open(const std::filesystem::path& file, const Describe& describe);
  void create(const std::filesystem::path& file) const;
  void read_header();
  void map();
  void read_table();
  std::uint64_t check_of(const Entry& entry, std::size_t tile) const;
  bool find(std::size_t tile);
  void put(std::size_t tile, const Entry& entry);
  void check_or_make(std::size_t tile);
  void make(std::size_t chunk);
  void make_tile(HeightGrid::Tile& tile, int tile_column, int tile_row, int first_column,
                 int first_row, int columns, std::span<const double> z_m) const;
  static std::uint64_t checksum_of_tile(const HeightGrid::Tile& tile, const Kinds* kinds);
  void write(std::uint64_t offset, std::span<const std::byte> bytes) const;
  bool read(std::uint64_t offset, std::span<std::byte> bytes) const;
  int tile_columns() const { return HeightGrid::tiles_across(static_cast<int>(shape_.x_m.size())); }
  int tile_rows() const { return HeightGrid::tiles_across(static_cast<int>(shape_.y_m.size())); }
  int chunk_columns() const { return (tile_columns() - 1) / chunk_tiles + 1; }

  Shape shape_;
  Heights heights_;
  std::string name_, key_;
  int descriptor_ = -1;
  bool with_kinds_ = false;
  const HeightGrid::Tile* tiles_ = nullptr;
  const Kinds* kinds_ = nullptr;
  void* mapping_ = nullptr;
  std::vector<Entry> entries_;
  std::unique_ptr<std::atomic<State>[]> states_;
  std::vector<std::mutex> chunk_locks_;
  std::atomic<std::size_t> made_ = 0;
};

}  // namespace ensonify::refine
