#include <ensonify/refine/height_tiles.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <limits>
#include <system_error>
#include <type_traits>
#include <utility>

#include <fcntl.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include <fmt/format.h>
#include <xxhash.h>

#include <ensonify/refine/atomic_file.h>
#include <ensonify/refine/file_page.h>
#include <ensonify/refine/read_file.h>

namespace ensonify::refine {
namespace {

using Tile = HeightGrid::Tile;
using Range = HeightGrid::Range;

constexpr std::array<char, 8> tiles_magic = file_magic('E', 'H', 'T');
constexpr std::uint32_t version = 1, version_with_kinds = 2;

template <class T>
std::span<const std::byte> bytes_of(const std::vector<T>& values) {
  return std::as_bytes(std::span(values));
}

[[noreturn]] void fail_in_cache(const std::string& file, const char* step, int error) {
  throw std::system_error(error, std::generic_category(),
                          fmt::format("{}: cannot {}; choose another folder with --cache, or free "
                                      "space there",
                                      file, step));
}

/// Copies the kinds of a tile whose first point is at (west, south) in a chunk of columns x rows
/// points; 0 beyond the grid.
void take_kinds(HeightTiles::Kinds& to, int west, int south, int columns, int rows,
                std::span<const std::uint8_t> kinds) {
  to.fill(0);
  const int across = std::min(HeightGrid::tile_points, columns - west);
  for (int row = 0; row < std::min(HeightGrid::tile_points, rows - south); ++row)
    std::copy_n(kinds.begin() + std::ptrdiff_t{south + row} * columns + west, across,
                to.begin() + row * HeightGrid::tile_points);
}

template <class Header>
std::uint64_t header_checksum(Header header, const HeightTiles::Shape& shape) {
  header.checksum = 0;
  const std::array<std::uint64_t, 3> parts = {
      XXH3_64bits(&header, sizeof header),
      XXH3_64bits(shape.x_m.data(), shape.x_m.size() * sizeof(float)),
      XXH3_64bits(shape.y_m.data(), shape.y_m.size() * sizeof(float))};
  return XXH3_64bits(parts.data(), sizeof parts);
}

}  // namespace

/// The file's first page, padded with zeros.
struct HeightTiles::Header {
  std::array<char, 8> magic;
  std::uint32_t version, byte_order;
  std::uint64_t checksum;  // of the header, with 0 in this place, and of the places
  std::uint64_t columns, rows;
  std::array<double, 3> world_origin;
  double mean_height_m;
  float lowest_m, highest_m;
  FileKey key;
};

/// The offsets of the file's parts: header, places of columns and rows, table, tiles, kinds.
struct HeightTiles::Layout {
  std::uint64_t places, table, tiles, kinds, end;
  Layout(std::uint64_t columns, std::uint64_t rows, std::uint64_t count, bool with_kinds)
      : places(page_bytes),
        table(places + page_end((columns + rows) * sizeof(float))),
        tiles(table + page_end(count * sizeof(Entry))),
        kinds(tiles + count * sizeof(Tile)),
        end(kinds + (with_kinds ? count * sizeof(Kinds) : 0)) {}
};

HeightTiles::Layout HeightTiles::layout() const {
  return {shape_.x_m.size(), shape_.y_m.size(), tiles(), with_kinds_};
}

// Both constructors delegate to the default one, so that the destructor runs if they throw.
HeightTiles::HeightTiles(std::vector<float> x_m, std::vector<float> y_m,
                         const Eigen::Vector3d& world_origin, const Describe& describe,
                         Heights heights, const std::filesystem::path& file, const std::string& key,
                         bool with_kinds)
    : HeightTiles() {
  shape_ = {std::move(x_m), std::move(y_m), world_origin};
  heights_ = std::move(heights);
  name_ = file.string();
  key_ = key;
  with_kinds_ = with_kinds;
  static_assert(sizeof(Entry) == 24 && std::is_trivially_copyable_v<Tile>);
  const std::uint64_t columns = shape_.x_m.size(), rows = shape_.y_m.size();
  check_has_cell(columns, rows);
  if (2 * (columns - 1) * (rows - 1) > max_numbers) throw_too_many_faces(columns, rows);
  open(file, describe);
  map();
  read_table();
}

HeightTiles::HeightTiles(const std::filesystem::path& file) : HeightTiles() {
  name_ = file.string();
  const FileReader reader(file);
  if (!reader.fault().empty()) throw MeshError(name_ + ": " + reader.fault());
  descriptor_ = ::fcntl(reader.descriptor(), F_DUPFD_CLOEXEC, 0);
  if (descriptor_ < 0)
    throw MeshError(
        fmt::format("{}: cannot be opened: {}", name_, std::generic_category().message(errno)));
  read_header();
  read_table();
}

HeightTiles::~HeightTiles() {
  if (mapping_ != nullptr) ::munmap(mapping_, file_bytes());
  if (descriptor_ >= 0) ::close(descriptor_);
}

bool HeightTiles::is_one(const std::filesystem::path& file) {
  return begins_with(file, {tiles_magic.data(), tiles_magic.size()});
}

std::uint64_t HeightTiles::file_bytes() const { return layout().end; }

/// Opens the file, or makes it if it is not there, and compares its header with the wanted grid.
void HeightTiles::open(const std::filesystem::path& file, const Describe& describe) {
  if (file.empty()) {
    describe(shape_);
    name_ = "tiles in memory";
    descriptor_ = ::memfd_create("ensonify-tiles", MFD_CLOEXEC);
    if (descriptor_ < 0) fail_in_cache(name_, "make a file in memory", errno);
    return;
  }
  for (int round = 0; round < 2 && descriptor_ < 0; ++round) {
    descriptor_ = ::open(file.c_str(), O_RDWR | O_CLOEXEC | O_NONBLOCK);
    if (descriptor_ >= 0) break;
    if (errno != ENOENT || round > 0) fail_in_cache(name_, "open it", errno);
    describe(shape_);
    create(file);
  }
  const Shape wanted = std::exchange(shape_, {});
  const std::string key = std::exchange(key_, {});
  const bool with_kinds = with_kinds_;
  read_header();
  if (key_ != key || with_kinds_ != with_kinds || shape_.x_m != wanted.x_m ||
      shape_.y_m != wanted.y_m || shape_.world_origin != wanted.world_origin)
    throw MeshError(fmt::format("{}: has the tiles of another seafloor", name_));
}

/// Writes a file without tiles. It appears complete, so another process either finds or makes it.
void HeightTiles::create(const std::filesystem::path& file) const {
  Header header{.magic = tiles_magic,
                .version = with_kinds_ ? version_with_kinds : version,
                .byte_order = byte_order,
                .checksum = 0,
                .columns = shape_.x_m.size(),
                .rows = shape_.y_m.size(),
                .world_origin = {},
                .mean_height_m = shape_.mean_height_m,
                .lowest_m = shape_.lowest_m,
                .highest_m = shape_.highest_m,
                .key = {}};
  std::copy_n(shape_.world_origin.data(), 3, header.world_origin.begin());
  std::ranges::copy(key_.substr(0, header.key.size()), header.key.begin());
  header.checksum = header_checksum(header, shape_);
  std::array<std::byte, page_bytes> first{};
  static_assert(sizeof header <= page_bytes);
  std::memcpy(first.data(), &header, sizeof header);
  const std::array<std::span<const std::byte>, 3> parts = {first, bytes_of(shape_.x_m),
                                                           bytes_of(shape_.y_m)};
  write_file(file, parts);
}

/// Reads the header and the places into shape_ and key_.
void HeightTiles::read_header() {
  const auto refuse = [&](const char* why) { throw MeshError(fmt::format("{}: {}", name_, why)); };
  Header header;
  if (!read(0, std::as_writable_bytes(std::span(&header, 1))) || header.magic != tiles_magic)
    refuse("is not a file of height tiles");
  if ((header.version != version && header.version != version_with_kinds) ||
      header.byte_order != byte_order)
    refuse("is of another version of ensonify, or of another kind of machine; remove it");
  // Checked before memory is allocated.
  const auto sound = [](std::uint64_t points) { return points >= 2 && points < 1u << 31; };
  if (!sound(header.columns) || !sound(header.rows) ||
      2 * (header.columns - 1) > max_numbers / (header.rows - 1))
    refuse("its header is damaged; remove it");
  shape_.x_m.resize(header.columns);
  shape_.y_m.resize(header.rows);
  if (!read(page_bytes, std::as_writable_bytes(std::span(shape_.x_m))) ||
      !read(page_bytes + header.columns * sizeof(float),
            std::as_writable_bytes(std::span(shape_.y_m))) ||
      header.checksum != header_checksum(header, shape_))
    refuse("its header is damaged; remove it");
  shape_.world_origin = Eigen::Vector3d(header.world_origin.data());
  with_kinds_ = header.version == version_with_kinds;
  shape_.mean_height_m = header.mean_height_m;
  shape_.lowest_m = header.lowest_m;
  shape_.highest_m = header.highest_m;
  key_ = text_of(header.key);
}

void HeightTiles::map() {
  const Layout layout = this->layout();
  struct stat status {};
  if (::fstat(descriptor_, &status) != 0) fail_in_cache(name_, "read its size", errno);
  // The file gets its full length, with a hole where tiles are not made yet. So no part of the
  // mapping is behind the file's end.
  if (static_cast<std::uint64_t>(status.st_size) < layout.end &&
      ::ftruncate(descriptor_, static_cast<off_t>(layout.end)) != 0)
    fail_in_cache(name_, "make it larger", errno);
  void* const at = ::mmap(nullptr, layout.end, PROT_READ, MAP_SHARED, descriptor_, 0);
  if (at == MAP_FAILED && errno == ENOMEM)
    throw std::system_error(
        ENOMEM, std::generic_category(),
        fmt::format(
            "{}: its {:.3g} GB do not fit into the address space of this process; raise its "
            "limit (ulimit -v), or make the bed's cells larger",
            name_, 1e-9 * static_cast<double>(layout.end)));
  if (at == MAP_FAILED) fail_in_cache(name_, "map it into memory", errno);
  // Fans touch tiles in scattered places, so reading ahead would fill the memory.
  ::madvise(at, layout.end, MADV_RANDOM);
  mapping_ = at;
  tiles_ = reinterpret_cast<const Tile*>(static_cast<const std::byte*>(at) + layout.tiles);
  if (with_kinds_)
    kinds_ = reinterpret_cast<const Kinds*>(static_cast<const std::byte*>(at) + layout.kinds);
}

void HeightTiles::read_table() {
  const auto chunks = static_cast<std::size_t>(chunk_columns()) *
                      static_cast<std::size_t>((tile_rows() - 1) / chunk_tiles + 1);
  chunk_locks_ = std::vector<std::mutex>(chunks);
  states_ = std::make_unique<std::atomic<State>[]>(tiles());
  entries_.resize(tiles());
  if (!read(layout().table, std::as_writable_bytes(std::span(entries_))))
    entries_.assign(tiles(), Entry{});
  std::size_t made = 0;
  for (std::size_t tile = 0; tile < tiles(); ++tile) {
    const bool there = entries_[tile].check == check_of(entries_[tile], tile);
    states_[tile].store(there ? State::there : State::absent, std::memory_order_relaxed);
    made += there;
  }
  made_ = made;
}

std::uint64_t HeightTiles::check_of(const Entry& entry, std::size_t tile) const {
  struct {
    std::uint64_t checksum;
    Range range;
    std::uint64_t tile;
  } const all{entry.checksum, entry.range, tile};
  return XXH3_64bits_withSeed(&all, sizeof all, 1);
}

std::uint64_t HeightTiles::checksum_of_tile(const Tile& tile, const Kinds* kinds) {
  const std::uint64_t of_heights = XXH3_64bits(&tile, sizeof tile);
  return kinds ? XXH3_64bits_withSeed(kinds, sizeof *kinds, of_heights) : of_heights;
}

/// Whether a tile is in the file and undamaged. The lock of its chunk must be held. The tile's
/// entry is read again, because another process may have made the tile.
bool HeightTiles::find(std::size_t tile) {
  const State state = states_[tile].load(std::memory_order_relaxed);
  if (state == State::checked) return true;
  Entry entry;
  if (!read(layout().table + tile * sizeof(Entry), std::as_writable_bytes(std::span(&entry, 1))) ||
      entry.check != check_of(entry, tile) ||
      entry.checksum != checksum_of_tile(tiles_[tile], with_kinds_ ? kinds_ + tile : nullptr))
    return false;
  put(tile, entry);
  return true;
}

/// Marks an undamaged tile as checked. If other threads may be reading its entry, the entry is not
/// written again, because it can only be the same.
void HeightTiles::put(std::size_t tile, const Entry& entry) {
  if (states_[tile].load(std::memory_order_relaxed) == State::absent) {
    entries_[tile] = entry;
    made_.fetch_add(1, std::memory_order_relaxed);
  }
  states_[tile].store(State::checked, std::memory_order_release);
}

void HeightTiles::check_or_make(std::size_t tile) {
  const int column = static_cast<int>(tile % static_cast<std::size_t>(tile_columns()));
  const int row = static_cast<int>(tile / static_cast<std::size_t>(tile_columns()));
  const std::size_t chunk =
      number_in_rows(row / chunk_tiles, chunk_columns(), column / chunk_tiles);
  const std::lock_guard lock(chunk_locks_[chunk]);
  // If the tile is absent, make() is called at once: it calls find() for all tiles of the chunk.
  if (states_[tile].load(std::memory_order_relaxed) == State::absent || !find(tile)) make(chunk);
}

void HeightTiles::require_chunk(std::size_t chunk) {
  const std::lock_guard lock(chunk_locks_[chunk]);
  make(chunk);
}

/// Makes the tiles of a chunk that are absent or damaged. The chunk's lock must be held.
void HeightTiles::make(std::size_t chunk) {
  const auto across = static_cast<std::size_t>(chunk_columns());
  const int first_tile_column = static_cast<int>(chunk % across) * chunk_tiles;
  const int first_tile_row = static_cast<int>(chunk / across) * chunk_tiles;
  const int first_column = first_tile_column * HeightGrid::tile_cells;
  const int first_row = first_tile_row * HeightGrid::tile_cells;
  const int columns =
      std::min(chunk_cells, static_cast<int>(shape_.x_m.size()) - 1 - first_column) + 1;
  const int rows = std::min(chunk_cells, static_cast<int>(shape_.y_m.size()) - 1 - first_row) + 1;
  std::vector<std::pair<std::size_t, std::array<int, 2>>> missing;
  for (int row = first_tile_row; row < std::min(first_tile_row + chunk_tiles, tile_rows()); ++row)
    for (int column = first_tile_column;
         column < std::min(first_tile_column + chunk_tiles, tile_columns()); ++column) {
      const std::size_t tile = number_in_rows(row, tile_columns(), column);
      if (!find(tile)) missing.push_back({tile, {column, row}});
    }
  if (missing.empty()) return;

  const std::size_t points = static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows);
  std::vector<double> z_m(points);
  std::vector<std::uint8_t> kinds(with_kinds_ ? points : 0);
  heights_(first_column, first_row, columns, rows, z_m, kinds);
  const Layout layout = this->layout();
  const auto made = std::make_unique<Tile>();
  Kinds its_kinds;
  for (const auto& [tile, place] : missing) {
    make_tile(*made, place[0], place[1], first_column, first_row, columns, z_m);
    Entry entry;
    entry.range = fill_ranges(*made);
    if (with_kinds_) {
      take_kinds(its_kinds, place[0] * HeightGrid::tile_cells - first_column,
                 place[1] * HeightGrid::tile_cells - first_row, columns, rows, kinds);
      write(layout.kinds + tile * sizeof(Kinds), std::as_bytes(std::span(its_kinds)));
    }
    entry.checksum = checksum_of_tile(*made, with_kinds_ ? &its_kinds : nullptr);
    entry.check = check_of(entry, tile);
    write(layout.tiles + tile * sizeof(Tile), std::as_bytes(std::span(made.get(), 1)));
    write(layout.table + tile * sizeof(Entry), std::as_bytes(std::span(&entry, 1)));
    put(tile, entry);
  }
}

/// Makes one tile, without its ranges, from the heights of a chunk.
void HeightTiles::make_tile(Tile& tile, int tile_column, int tile_row, int first_column,
                            int first_row, int columns, std::span<const double> z_m) const {
  tile = {};
  std::ranges::fill(tile.z_m, std::numeric_limits<float>::quiet_NaN());
  tile.z_m.back() = 0.0f;
  const int west = tile_column * HeightGrid::tile_cells, south = tile_row * HeightGrid::tile_cells;
  const int across =
      std::min(HeightGrid::tile_cells, static_cast<int>(shape_.x_m.size()) - 1 - west);
  const int up = std::min(HeightGrid::tile_cells, static_cast<int>(shape_.y_m.size()) - 1 - south);
  const auto row_of = [&](int row) {
    return z_m.subspan(number_in_rows(south - first_row + row, columns, west - first_column),
                       static_cast<std::size_t>(across) + 1);
  };
  for (int row = 0; row <= up; ++row)
    std::ranges::transform(row_of(row), tile.z_m.begin() + row * HeightGrid::tile_points,
                           [](double z) { return static_cast<float>(z); });
  for (int row = 0; row < up; ++row) {
    const RowOfCells cells = row_of_cells(
        row_of(row), row_of(row + 1), tile.z_m.data() + row * HeightGrid::tile_points, south + row);
    const auto line = static_cast<std::size_t>(row);
    tile.whole[line] = cells.whole;
    tile.rising[line] = cells.rising & cells.whole;
    const auto cells_before = static_cast<std::uint64_t>(south + row) * (shape_.x_m.size() - 1) +
                              static_cast<std::uint64_t>(west);
    tile.first_face[line] = static_cast<std::uint32_t>(2 * cells_before);
  }
}

void HeightTiles::write(std::uint64_t offset, std::span<const std::byte> bytes) const {
  while (!bytes.empty()) {
    const ssize_t written =
        ::pwrite(descriptor_, bytes.data(), bytes.size(), static_cast<off_t>(offset));
    if (written < 0 && errno != EINTR) fail_in_cache(name_, "write it", errno);
    if (written <= 0) continue;
    bytes = bytes.subspan(static_cast<std::size_t>(written));
    offset += static_cast<std::uint64_t>(written);
  }
}

bool HeightTiles::read(std::uint64_t offset, std::span<std::byte> bytes) const {
  while (!bytes.empty()) {
    const ssize_t got =
        ::pread(descriptor_, bytes.data(), bytes.size(), static_cast<off_t>(offset));
    if (got < 0 && errno == EINTR) continue;
    if (got <= 0) return false;
    bytes = bytes.subspan(static_cast<std::size_t>(got));
    offset += static_cast<std::uint64_t>(got);
  }
  return true;
}

std::vector<Range> HeightTiles::ranges() const {
  std::vector<Range> all;
  all.reserve(tiles());
  for (std::size_t tile = 0; tile < tiles(); ++tile) all.push_back(range(tile));
  return all;
}

}  // namespace ensonify::refine
