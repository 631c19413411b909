#pragma once

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <filesystem>
#include <memory>
#include <mutex>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include <ensonify/refine/active_mesh.h>
#include <ensonify/refine/fan_volume.h>
#include <ensonify/refine/footprint.h>
#include <ensonify/refine/height_grid.h>
#include <ensonify/refine/progressive_mesh.h>
#include <ensonify/refine/tiles_in_view.h>
#include <ensonify/refine/triangle_mesh.h>

namespace ensonify::refine {

/// A height grid of any size, with bodies on it, as clusters: a progressive mesh for each square of
/// 4 x 4 tiles, and one for all bodies. The borders of the squares are never collapsed, so
/// neighbours fit each other at any resolution. A cluster is analysed when it is first needed. It
/// depends only on its place, not on the process that makes it, the time or the order. Thread-safe.
class MeshClusters {
 public:
  static constexpr int cluster_tiles = 4;  ///< in both directions
  static constexpr int cluster_cells = cluster_tiles * HeightGrid::tile_cells;

  /// The bodies' faces have the numbers that follow those of the grid. The squares are kept in
  /// `folder`, one file each. The folder is made with the first file. If it is empty or cannot be
  /// written, the squares are in memory. `key`, of at most 64 bytes, identifies what the grid is
  /// made from. A file with another key, or a damaged file, is made again. The grid must outlive
  /// this object.
  MeshClusters(const HeightGrid& grid, const TriangleMesh& bodies, std::filesystem::path folder,
               std::string key);

  /// The number of clusters: all squares, then the cluster of the bodies, if there are bodies.
  std::size_t count() const { return locks_.size() + (bodies_ ? 1 : 0); }
  bool has_bodies() const { return bodies_ != nullptr; }
  /// The square that a tile belongs to.
  std::size_t with_tile(int tile_column, int tile_row) const;

  /// Whether a cluster has faces. The tiles of the cluster must have been made.
  bool has_faces(std::size_t cluster) const;
  /// A cluster, which must have faces. Throws what HeightGrid::tile() throws, and MeshError for
  /// more vertices than a mesh can number.
  std::shared_ptr<const ProgressiveMesh> get(std::size_t cluster);

  /// The number of clusters that get() has analysed rather than read.
  std::size_t analysed() const { return analysed_.load(std::memory_order_relaxed); }

  const HeightGrid& grid() const { return *grid_; }

  /// The file of a square in a folder of squares.
  static std::filesystem::path file_of(const std::filesystem::path& folder, std::size_t cluster);

 private:
  ProgressiveMesh open_or_make(std::size_t cluster);
  ProgressiveMesh analyse(std::size_t cluster);
  int columns() const { return (grid_->tile_columns() - 1) / cluster_tiles + 1; }

  // The clusters that were used last stay in memory.
  static constexpr std::size_t max_recent = 64;

  const HeightGrid* grid_;
  std::filesystem::path folder_;
  std::string key_;
  std::shared_ptr<const ProgressiveMesh> bodies_;
  std::vector<std::mutex> locks_;  // by square; held while the square is made
  std::atomic<std::size_t> analysed_ = 0;
  std::mutex mutex_;  // for the members that follow
  std::vector<std::weak_ptr<const ProgressiveMesh>> in_use_;
  std::deque<std::shared_ptr<const ProgressiveMesh>> recent_;
};

/// The clusters that fan volumes can touch.
class ClustersInView {
 public:
  /// The clusters must outlive this.
  explicit ClustersInView(const MeshClusters& clusters)
      : clusters_(&clusters), tiles_(clusters.grid()) {}

  /// Returns the numbers of the clusters, ascending; valid until the next call. Throws what
  /// HeightGrid::tile() throws, and std::invalid_argument as ViewTest does.
  std::span<const std::size_t> find(std::span<const FanVolume> volumes);

 private:
  const MeshClusters* clusters_;
  TilesInView tiles_;
  std::vector<std::size_t> numbers_;
};

/// One worker's selectively refined mesh over clusters, for all its sonars: an active mesh in each
/// cluster that the last volumes could touch. All other clusters count as coarse.
class ActiveClusters {
 public:
  /// The clusters must outlive this.
  explicit ActiveClusters(MeshClusters& clusters) : clusters_(&clusters), in_view_(clusters) {}

  /// Splits all nodes that the volumes touch and collapses those that no volume touches. Returns
  /// the exact faces, which include all that the volumes can touch; they are valid until the second
  /// call after this one. Allocates no memory while no cluster is added. Throws what
  /// MeshClusters::get() throws, and std::invalid_argument as ViewTest does. After that, only
  /// reset() and the destructor may be called.
  ExactFaces refine(std::span<const FanVolume> volumes);

  /// Drops all active meshes.
  void reset() { active_.clear(); }

  /// A cluster in view and its active mesh.
  struct Active {
    Active(std::size_t number, std::shared_ptr<const ProgressiveMesh> its)
        : cluster(number),
          progressive(std::move(its)),
          mesh(*progressive),
          place_of_leaf(progressive->leaves(), 0) {}
    std::size_t cluster;
    std::shared_ptr<const ProgressiveMesh> progressive;
    ActiveMesh mesh;
    std::vector<std::uint32_t> place_of_leaf;  ///< valid for the leaves in leaves_
  };
  std::span<const std::unique_ptr<Active>> active() const { return active_; }

 private:
  struct List {
    std::vector<Eigen::Vector3f> points;
    std::vector<Face> faces;
    std::vector<std::uint32_t> source_faces;
  };
  void take(std::span<const std::size_t> wanted);
  void add(Active& active, List& list);

  MeshClusters* clusters_;
  ClustersInView in_view_;
  std::vector<std::unique_ptr<Active>> active_, next_;
  std::vector<std::uint32_t> leaves_;  // of one cluster's exact faces
  std::array<List, 2> lists_;          // used alternately
  std::size_t turn_ = 0;
};

}  // namespace ensonify::refine
