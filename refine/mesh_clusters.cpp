#include <ensonify/refine/mesh_clusters.h>

#include <algorithm>
#include <system_error>

#include <fmt/format.h>

#include <ensonify/refine/progressive_mesh_file.h>
#include <ensonify/refine/tile_collapse.h>

namespace ensonify::refine {
namespace {

namespace fs = std::filesystem;

/// The progressive mesh of a mesh whose face i has the number number_of(i).
ProgressiveMesh numbered(const TriangleMesh& mesh, auto number_of, Borders borders) {
  ProgressiveMeshArrays built = build_of_any_mesh(mesh, 1, borders);
  for (std::uint32_t& face : built.source_face)
    if (face != ProgressiveMesh::none) face = number_of(face);
  return built;
}

}  // namespace

MeshClusters::MeshClusters(const HeightGrid& grid, const TriangleMesh& bodies, fs::path folder,
                           std::string key)
    : grid_(&grid), folder_(std::move(folder)), key_(std::move(key)) {
  const int rows = (grid.tile_rows() - 1) / cluster_tiles + 1;
  locks_ =
      std::vector<std::mutex>(static_cast<std::size_t>(columns()) * static_cast<std::size_t>(rows));
  in_use_.resize(locks_.size());
  if (bodies.faces.empty()) return;
  const auto first = static_cast<std::uint32_t>(grid.faces());
  bodies_ = std::make_shared<const ProgressiveMesh>(numbered(
      bodies, [&](std::uint32_t face) { return first + face; }, Borders::collapse));
}

std::size_t MeshClusters::with_tile(int tile_column, int tile_row) const {
  return number_in_rows(tile_row / cluster_tiles, columns(), tile_column / cluster_tiles);
}

bool MeshClusters::has_faces(std::size_t cluster) const {
  if (cluster == locks_.size()) return bodies_ != nullptr;
  const auto across = static_cast<std::size_t>(columns());
  const int first_column = static_cast<int>(cluster % across) * cluster_tiles;
  const int first_row = static_cast<int>(cluster / across) * cluster_tiles;
  for (int row = first_row; row < std::min(first_row + cluster_tiles, grid_->tile_rows()); ++row)
    for (int column = first_column;
         column < std::min(first_column + cluster_tiles, grid_->tile_columns()); ++column)
      if (!grid_->range(0, column, row).empty()) return true;
  return false;
}

fs::path MeshClusters::file_of(const fs::path& folder, std::size_t cluster) {
  return folder / fmt::format("{}.mesh", cluster);
}

std::shared_ptr<const ProgressiveMesh> MeshClusters::get(std::size_t cluster) {
  if (cluster == locks_.size()) return bodies_;
  const std::lock_guard making(locks_[cluster]);
  {
    const std::lock_guard lock(mutex_);
    if (auto found = in_use_[cluster].lock()) return found;
  }
  auto made = std::make_shared<const ProgressiveMesh>(open_or_make(cluster));
  const std::lock_guard lock(mutex_);
  in_use_[cluster] = made;
  recent_.push_back(made);
  if (recent_.size() > max_recent) recent_.pop_front();
  return made;
}

ProgressiveMesh MeshClusters::open_or_make(std::size_t cluster) {
  if (folder_.empty()) return analyse(cluster);
  const fs::path file = file_of(folder_, cluster);
  std::error_code unreadable;  // is treated as not there
  if (fs::exists(file, unreadable)) {
    try {
      ProgressiveMesh found = map_progressive_mesh(file);
      found.verify_all();
      if (found.key() == key_) return found;
    } catch (const MeshError&) {  // damaged: it is made again
    }
  }
  ProgressiveMesh made = analyse(cluster);
  try {
    fs::create_directories(folder_);
    save(made, {.key = key_}, file);
    return map_progressive_mesh(file);  // the system can take back its memory
  } catch (const std::system_error&) {  // no room: it stays in memory
  } catch (const MeshError&) {          // another process removed it
  }
  return made;
}

ProgressiveMesh MeshClusters::analyse(std::size_t cluster) {
  ++analysed_;
  const auto across = static_cast<std::size_t>(columns());
  const int first_column = static_cast<int>(cluster % across) * cluster_cells;
  const int first_row = static_cast<int>(cluster / across) * cluster_cells;
  std::vector<std::uint32_t> numbers;
  const TriangleMesh mesh =
      grid_->mesh(first_column, std::min(first_column + cluster_cells, grid_->columns() - 1),
                  first_row, std::min(first_row + cluster_cells, grid_->rows() - 1), &numbers);
  return numbered(
      mesh, [&](std::uint32_t face) { return numbers[face]; }, Borders::stay);
}

std::span<const std::size_t> ClustersInView::find(std::span<const FanVolume> volumes) {
  tiles_.look_at(volumes);
  numbers_.clear();
  tiles_.for_each([this](const HeightGrid::Tile&, int column, int row) {
    const std::size_t cluster = clusters_->with_tile(column, row);
    if (numbers_.empty() || numbers_.back() != cluster) numbers_.push_back(cluster);
  });
  if (clusters_->has_bodies()) numbers_.push_back(clusters_->count() - 1);
  std::ranges::sort(numbers_);
  numbers_.erase(std::unique(numbers_.begin(), numbers_.end()), numbers_.end());
  return numbers_;
}

/// Makes the wanted clusters the active ones: others are dropped, and missing ones are added.
void ActiveClusters::take(std::span<const std::size_t> wanted) {
  next_.clear();
  auto old = active_.begin();
  for (const std::size_t cluster : wanted) {
    while (old != active_.end() && (*old)->cluster < cluster) ++old;
    if (old != active_.end() && (*old)->cluster == cluster)
      next_.push_back(std::move(*old++));
    else
      next_.push_back(std::make_unique<Active>(cluster, clusters_->get(cluster)));
  }
  active_.swap(next_);
  next_.clear();
}

/// Adds a cluster's exact faces, with the points that they use.
void ActiveClusters::add(Active& active, List& list) {
  const ExactFaces exact = active.mesh.exact_faces();
  const auto first = static_cast<std::uint32_t>(list.points.size());
  leaves_.clear();
  // A leaf's place is valid only if the list of leaves has the leaf there. So places of earlier
  // calls need not be cleared.
  const auto place_of = [&](std::uint32_t leaf) {
    std::uint32_t& place = active.place_of_leaf[leaf];
    if (place >= leaves_.size() || leaves_[place] != leaf) {
      place = static_cast<std::uint32_t>(leaves_.size());
      leaves_.push_back(leaf);
      list.points.push_back(exact.points[leaf]);
    }
    return first + place;
  };
  for (const Face& face : exact.faces)
    list.faces.push_back({place_of(face[0]), place_of(face[1]), place_of(face[2])});
  list.source_faces.insert(list.source_faces.end(), exact.source_faces.begin(),
                           exact.source_faces.end());
}

ExactFaces ActiveClusters::refine(std::span<const FanVolume> volumes) {
  take(in_view_.find(volumes));
  turn_ = 1 - turn_;
  List& list = lists_[turn_];
  list.points.clear();
  list.faces.clear();
  list.source_faces.clear();
  for (const std::unique_ptr<Active>& active : active_) {
    active->mesh.refine(volumes);
    add(*active, list);
  }
  return {list.points, list.faces, list.source_faces};
}

}  // namespace ensonify::refine
