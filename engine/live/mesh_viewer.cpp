#include <ensonify/engine/live/mesh_viewer.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <utility>

#include <fmt/format.h>

#include <ensonify/engine/trace/face_sources/exact_faces.h>
#include <ensonify/refine/tile_collapse.h>

namespace ensonify::engine {
namespace {

constexpr std::size_t max_faces = 80'000;
constexpr double steps = 32000.0;  // MeshPatch::step_m from the middle to the edge; fits an int16

std::shared_ptr<const refine::ProgressiveMesh> progressive_of(
    const Seafloor& seafloor, const MemoryLimit& memory, const std::function<void()>& stop_check) {
  if (seafloor.progressive) return seafloor.progressive;
  if (seafloor.in_tiles())
    throw Error(
        "the bed is made in tiles, only where pings need it; for the mesh, all of it must be there");
  memory.require(static_cast<double>(seafloor.faces) *
                     (refine::mesh_bytes_per_face + refine::tile_collapse_bytes_per_face),
                 fmt::format("the {} faces of the seafloor and their analysis", seafloor.faces),
                 "use larger cells or a smaller area");
  return with_memory_for("the mesh for display", [&] {
    return make_progressive_mesh(seafloor.whole_mesh(stop_check), 1, stop_check);
  });
}

}  // namespace

MeshPreview::MeshPreview(const Seafloor& seafloor, const MemoryLimit& memory,
                         const std::function<void()>& stop_check)
    : progressive_(progressive_of(seafloor, memory, stop_check)),
      mesh_(std::make_unique<refine::ActiveMesh>(*progressive_)) {}

MeshPatch MeshPreview::look(std::span<const refine::FanVolume> volumes, double within_m) {
  const refine::RefineStatistics did = mesh_->refine(volumes);
  counts_ = {.splits = did.splits,
             .collapses = did.collapses,
             .active_faces = mesh_->face_count(),
             .exact_faces = mesh_->exact_faces().faces.size()};

  MeshPatch patch{.middle = volumes.front().apex, .step_m = 4.0 * within_m / steps};
  const auto middle = patch.middle.cast<float>().eval();
  const auto nodes = mesh_->nodes();
  const auto gather = [&](bool exact) {
    for (const refine::ActiveMesh::ActiveFace& face : mesh_->faces()) {
      if (face.slot == refine::ActiveMesh::none || patch.exact.size() >= max_faces) continue;
      bool leaves = true, fits = true;
      std::array<Eigen::Vector3f, 3> corners;
      for (std::size_t k = 0; k < 3; ++k) {
        leaves = leaves && nodes[face.vertices[k]].is_leaf();
        corners[k] = mesh_->position(face.vertices[k]) - middle;
        fits = fits && corners[k].cwiseAbs().maxCoeff() < 3.9 * within_m;
      }
      if (leaves != exact || !fits) continue;
      const Eigen::Array3f low = corners[0].cwiseMin(corners[1]).cwiseMin(corners[2]);
      const Eigen::Array3f high = corners[0].cwiseMax(corners[1]).cwiseMax(corners[2]);
      // The horizontal distance of the face's bounding box from the apex.
      if (low.max(-high).max(0.0f).head<2>().matrix().norm() > within_m) continue;
      for (const Eigen::Vector3f& corner : corners)
        for (int k = 0; k < 3; ++k)
          patch.corners.push_back(static_cast<std::int16_t>(std::lround(corner[k] / patch.step_m)));
      patch.exact.push_back(exact ? 1 : 0);
    }
  };
  gather(false);
  gather(true);
  return patch;
}

MeshViewer::MeshViewer(LineRing& ring, std::function<void(const std::string& what)> trouble)
    : ring_(ring), trouble_(std::move(trouble)), thread_([this] { work(); }) {}

MeshViewer::~MeshViewer() {
  {
    const std::lock_guard lock(lock_);
    stopping_ = true;
  }
  woken_.notify_all();
  thread_.join();
}

void MeshViewer::show(std::shared_ptr<const LiveScene> scene,
                      std::vector<refine::FanVolume> volumes) {
  {
    const std::lock_guard lock(lock_);
    wanted_ = {std::move(scene), std::move(volumes)};
  }
  woken_.notify_all();
}

std::optional<MeshCounts> MeshViewer::counts() const {
  const std::lock_guard lock(lock_);
  return counts_;
}

void MeshViewer::work() {
  using Clock = std::chrono::steady_clock;
  std::shared_ptr<const LiveScene> shown;
  std::unique_ptr<MeshPreview> view;
  struct Stopping {};
  const auto stop_check = [this] {
    const std::lock_guard lock(lock_);
    if (stopping_) throw Stopping{};
  };
  while (true) {
    Wanted wanted;
    {
      std::unique_lock lock(lock_);
      woken_.wait(lock, [&] { return stopping_ || wanted_.scene; });
      if (stopping_) return;
      wanted = std::exchange(wanted_, {});
    }
    try {
      if (wanted.scene != shown) {
        view.reset();
        shown = wanted.scene;
        view =
            std::make_unique<MeshPreview>(shown->simulator.seafloor(), shown->memory, stop_check);
        continue;  // this took long, so the volumes are out of date
      }
      if (!view) continue;
      double range_m = 0.0;
      for (const refine::FanVolume& volume : wanted.volumes)
        range_m = std::max(range_m, volume.range_m);
      const Clock::time_point start = Clock::now();
      ring_.post(LatestFrame::mesh, mesh_frame(view->look(wanted.volumes, 1.15 * range_m)));
      std::unique_lock lock(lock_);
      counts_ = view->counts();
      woken_.wait_for(lock, 3 * (Clock::now() - start), [&] { return stopping_; });
    } catch (const Stopping&) {
      return;
    } catch (const std::exception& error) {
      view.reset();
      trouble_(fmt::format("the mesh cannot be shown: {}", error.what()));
    }
  }
}

}  // namespace ensonify::engine
