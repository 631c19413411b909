#include <ensonify/engine/seafloor/bed/generated_tiles.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <stdexcept>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include <ensonify/engine/seafloor/bed/relief_fields.h>
#include <ensonify/engine/seafloor/bed/tiled_field.h>

namespace ensonify::engine {
namespace {

constexpr int block = TiledField::block_points;
constexpr std::size_t most_blocks = 24;  // of 4 MB, that are kept whole

class GeneratedTiles {
 public:
  GeneratedTiles(const Heightfield& grid, double depth_m, const FractalRelief& fractal,
                 const RippleRelief& ripples, std::uint64_t seed)
      : grid_(grid),
        depth_m_(depth_m),
        fractal_(fractal),
        ripples_(ripples),
        fractal_field_(fractal_field(grid, fractal)),
        ripple_field_(ripple_field(grid, ripples)),
        seed_(seed),
        has_border_(number_of({(grid.rows - 1) / block, blocks_across() - 1}) + 1, 0) {
    borders_.resize(has_border_.size() * 2 * block);
    blocks_.reserve(most_blocks);
  }

  void heights(int first_column, int first_row, int columns, int rows, std::span<double> z_m) {
    std::call_once(prepared_, [&] { prepare(); });
    const auto blocks = [](int first, int count) {
      return std::array{first / block, (first + count - 1) / block};
    };
    const auto [west, east] = blocks(first_column, columns);
    const auto [south, north] = blocks(first_row, rows);
    for (int row = south; row <= north; ++row)
      for (int column = west; column <= east; ++column) {
        const int from_column = std::max(first_column, column * block);
        const int from_row = std::max(first_row, row * block);
        const int end_column = std::min(first_column + columns, (column + 1) * block);
        const int end_row = std::min(first_row + rows, (row + 1) * block);
        // A window that ends with a block's first points needs no more of it.
        const bool is_border = end_column - column * block == 1 || end_row - row * block == 1;
        const float* const border = is_border ? known_border(column, row) : nullptr;
        const BlockInUse whole = border ? BlockInUse() : block_at(column, row);
        for (int j = from_row; j < end_row; ++j)
          for (int i = from_column; i < end_column; ++i) {
            const auto x = static_cast<std::size_t>(i - column * block);
            const auto y = static_cast<std::size_t>(j - row * block);
            z_m[static_cast<std::size_t>(j - first_row) * static_cast<std::size_t>(columns) +
                static_cast<std::size_t>(i - first_column)] =
                whole ? whole->z_m[y * block + x] : border[y == 0 ? x : block + y];
          }
      }
  }

 private:
  using Place = std::pair<int, int>;  // row, column
  /// Blocks are used again for other places, and borders lie in one array. If they were freed and
  /// allocated among the large arrays of the transforms, they would fragment the memory.
  struct Block {
    Place place{-1, -1};
    std::uint64_t used = 0;  // the larger, the later
    int users = 0;           // threads that have it
    std::mutex making;
    bool made = false;
    std::vector<float> z_m;
  };

  void prepare() {
    if (fractal_.height_at_1m_m > 0.0)
      relief_.emplace(grid_, fractal_field_, seed_, Purpose::fractal_relief);
    if (ripples_.rms_height_m > 0.0)
      its_ripples_.emplace(grid_, ripple_field_, seed_, Purpose::ripple_relief);
  }

  int blocks_across() const { return (grid_.columns - 1) / block + 1; }
  std::size_t number_of(const Place& place) const {
    return static_cast<std::size_t>(place.first) * static_cast<std::size_t>(blocks_across()) +
           static_cast<std::size_t>(place.second);
  }

  /// The first row of a block and then its first column, where its neighbours' tiles end; null if
  /// it was not made yet.
  const float* known_border(int column, int row) {
    const std::lock_guard lock(mutex_);
    const std::size_t number = number_of({row, column});
    return has_border_[number] != 0 ? &borders_[number * 2 * block] : nullptr;
  }

  using BlockInUse = std::unique_ptr<Block, std::function<void(Block*)>>;

  BlockInUse block_at(int column, int row) {
    BlockInUse wanted(&block_for({row, column}), [this](Block* used) {
      const std::lock_guard lock(mutex_);
      --used->users;
    });
    const std::lock_guard lock(wanted->making);
    if (!wanted->made) make(*wanted, {row, column});
    wanted->made = true;
    return wanted;
  }

  Block& block_for(const Place& place) {
    const std::lock_guard lock(mutex_);
    auto found = std::ranges::find(blocks_, place, [](const auto& each) { return each->place; });
    if (found == blocks_.end()) {
      // The one that was used longest ago, unless a thread has it.
      if (blocks_.size() >= most_blocks)
        found = std::ranges::min_element(
            blocks_, {}, [](const auto& each) { return std::pair(each->users > 0, each->used); });
      if (found == blocks_.end() || (*found)->users > 0)
        found = blocks_.insert(blocks_.end(), std::make_unique<Block>());
      (*found)->place = place;
      (*found)->made = false;
    }
    (*found)->used = ++uses_;
    ++(*found)->users;
    return **found;
  }

  void make(Block& made, const Place& place) {
    const auto [row, column] = place;
    std::vector<double> z_m(std::size_t{block} * block, -depth_m_);
    if (relief_) relief_->add_block(column, row, z_m);
    if (its_ripples_) its_ripples_->add_block(column, row, z_m);
    const double highest = *std::ranges::max_element(z_m);
    if (!(highest <= 0.0))
      throw std::invalid_argument(fmt::format(
          "seafloor: the bed rises {:.3g} m above the sea surface at a mean depth of {} m; make it "
          "deeper, or the relief lower",
          highest, depth_m_));
    made.z_m.assign(z_m.begin(), z_m.end());
    const std::lock_guard lock(mutex_);
    float* const border = &borders_[number_of(place) * 2 * block];
    std::copy_n(made.z_m.begin(), block, border);
    for (std::size_t i = 0; i < block; ++i) border[block + i] = made.z_m[i * block];
    has_border_[number_of(place)] = 1;
  }

  const Heightfield grid_;
  const double depth_m_;
  const FractalRelief fractal_;
  const RippleRelief ripples_;
  const SpectralField fractal_field_, ripple_field_;
  const std::uint64_t seed_;
  std::once_flag prepared_;
  std::optional<TiledField> relief_, its_ripples_;

  std::mutex mutex_;  // of the following
  std::uint64_t uses_ = 0;
  std::vector<std::unique_ptr<Block>> blocks_;
  std::vector<float> borders_;
  std::vector<std::uint8_t> has_border_;
};

}  // namespace

refine::HeightTiles::Heights generated_tiles(const Heightfield& grid, double depth_m,
                                             const FractalRelief& fractal,
                                             const RippleRelief& ripples, std::uint64_t seed) {
  const auto tiles = std::make_shared<GeneratedTiles>(grid, depth_m, fractal, ripples, seed);
  return [tiles](int first_column, int first_row, int columns, int rows, std::span<double> z_m,
                 std::span<std::uint8_t>) {
    tiles->heights(first_column, first_row, columns, rows, z_m);
  };
}

}  // namespace ensonify::engine
