#include <ensonify/engine/seafloor/bed/generated_tiles.h>

#include <cstddef>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <vector>

#include <ensonify/engine/seafloor/bed/height_blocks.h>
#include <ensonify/engine/seafloor/bed/relief_fields.h>
#include <ensonify/engine/seafloor/bed/tiled_field.h>

namespace ensonify::engine {
namespace {

class GeneratedTiles {
 public:
  GeneratedTiles(const Heightfield& grid, const MeanPlane& plane, const FractalRelief& fractal,
                 const RippleRelief& ripples, std::uint64_t seed)
      : grid_(grid),
        plane_(plane),
        fractal_(fractal),
        ripples_(ripples),
        fractal_field_(fractal_field(grid, fractal)),
        ripple_field_(ripple_field(grid, ripples)),
        seed_(seed) {}

  void heights(int first_column, int first_row, int columns, int rows, std::span<double> z_m) {
    std::call_once(prepared_, [&] { prepare(); });
    blocks_.for_each(first_column, first_row, columns, rows, [&](int column, int row, float z) {
      z_m[static_cast<std::size_t>(row) * static_cast<std::size_t>(columns) +
          static_cast<std::size_t>(column)] = z;
    });
  }

 private:
  void prepare() {
    if (fractal_.height_at_1m_m > 0.0)
      relief_.emplace(grid_, fractal_field_, seed_, Purpose::fractal_relief);
    if (ripples_.rms_height_m > 0.0)
      its_ripples_.emplace(grid_, ripple_field_, seed_, Purpose::ripple_relief);
  }

  void make(int column, int row, std::vector<double>& z_m) const {
    constexpr int block = HeightBlocks::block;
    lay(plane_, grid_.window(column * block, row * block, block, block), z_m);
    if (relief_) relief_->add_block(column, row, z_m);
    if (its_ripples_) its_ripples_->add_block(column, row, z_m);
  }

  const Heightfield grid_;
  const MeanPlane plane_;
  const FractalRelief fractal_;
  const RippleRelief ripples_;
  const SpectralField fractal_field_, ripple_field_;
  const std::uint64_t seed_;
  std::once_flag prepared_;
  std::optional<TiledField> relief_, its_ripples_;
  HeightBlocks blocks_{
      grid_.columns, grid_.rows,
      [this](int column, int row, std::vector<double>& z_m) { make(column, row, z_m); }};
};

}  // namespace

refine::HeightTiles::Heights generated_tiles(const Heightfield& grid, const MeanPlane& plane,
                                             const FractalRelief& fractal,
                                             const RippleRelief& ripples, std::uint64_t seed) {
  const auto tiles = std::make_shared<GeneratedTiles>(grid, plane, fractal, ripples, seed);
  return [tiles](int first_column, int first_row, int columns, int rows, std::span<double> z_m,
                 std::span<std::uint8_t>) {
    tiles->heights(first_column, first_row, columns, rows, z_m);
  };
}

}  // namespace ensonify::engine
