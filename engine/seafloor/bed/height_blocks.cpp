#include <ensonify/engine/seafloor/bed/height_blocks.h>

namespace ensonify::engine {
namespace {

constexpr std::size_t max_blocks = 24;      // blocks of 4 MB in memory, or more if threads use more
constexpr double coarse_cells = 4194304.0;  // most coarse cells of a FieldInWindows: 32 MB

}  // namespace

HeightBlocks::HeightBlocks(int columns, int rows, Make make)
    : across_((columns - 1) / block + 1),
      make_(std::move(make)),
      has_border_(number_of({(rows - 1) / block, across_ - 1}) + 1, 0) {
  borders_.resize(has_border_.size() * 2 * block);
  blocks_.reserve(max_blocks);
}

/// The first row and then the first column of a block, at which windows in neighbouring blocks end;
/// null if the block was not made yet.
const float* HeightBlocks::known_border(int column, int row) {
  const std::lock_guard lock(mutex_);
  const std::size_t number = number_of({row, column});
  return has_border_[number] != 0 ? &borders_[number * 2 * block] : nullptr;
}

HeightBlocks::BlockInUse HeightBlocks::block_at(int column, int row) {
  BlockInUse wanted(&block_for({row, column}), [this](Block* used) {
    const std::lock_guard lock(mutex_);
    --used->users;
  });
  const std::lock_guard lock(wanted->making);
  if (!wanted->made) fill(*wanted, {row, column});
  wanted->made = true;
  return wanted;
}

HeightBlocks::Block& HeightBlocks::block_for(const Place& place) {
  const std::lock_guard lock(mutex_);
  auto found = std::ranges::find(blocks_, place, [](const auto& each) { return each->place; });
  if (found == blocks_.end()) {
    // Takes the block whose last use is longest ago, unless threads use all blocks.
    if (blocks_.size() >= max_blocks)
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

void HeightBlocks::fill(Block& to, const Place& place) {
  const auto [row, column] = place;
  std::vector<double> z_m(std::size_t{block} * block, 0.0);
  make_(column, row, z_m);
  to.z_m.assign(z_m.begin(), z_m.end());
  const std::lock_guard lock(mutex_);
  float* const border = &borders_[number_of(place) * 2 * block];
  std::copy_n(to.z_m.begin(), block, border);
  for (std::size_t i = 0; i < block; ++i) border[block + i] = to.z_m[i * block];
  has_border_[number_of(place)] = 1;
}

FieldInWindows::FieldInWindows(const Heightfield& grid, SpectralField what, std::uint64_t seed,
                               Purpose purpose, std::uint64_t number)
    : field_(grid, std::move(what), seed, purpose, coarse_cells, number),
      blocks_(grid.columns, grid.rows, [this](int column, int row, std::vector<double>& z_m) {
        field_.add_block(column, row, z_m);
      }) {}

void FieldInWindows::add(int first_column, int first_row, int columns, int rows,
                         std::span<double> z_m) {
  blocks_.for_each(first_column, first_row, columns, rows, [&](int column, int row, float z) {
    z_m[static_cast<std::size_t>(row) * static_cast<std::size_t>(columns) +
        static_cast<std::size_t>(column)] += z;
  });
}

}  // namespace ensonify::engine
