#include <ensonify/engine/live/mesh_viewer.h>

#include <algorithm>
#include <chrono>
#include <utility>

#include <fmt/format.h>

#include <ensonify/engine/live/frames.h>

namespace ensonify::engine {

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
