#include <ensonify/engine/trace/face_sources/scanned_grid.h>

#include <stdexcept>
#include <utility>
#include <vector>

#include <ensonify/engine/trace/face_sources/exact_faces.h>
#include <ensonify/engine/trace/grid_scan/grid_scan.h>
#include <ensonify/engine/trace/grid_scan/nearest_runs.h>
#include <ensonify/refine/ball_tree.h>

namespace ensonify::engine {
namespace {

class ScannedGrid final : public FaceSource {
 public:
  ScannedGrid(const FaceSourceParts& parts, std::unique_ptr<FaceSource> exact)
      : grid_(parts.grid), scan_(*grid_), exact_(std::move(exact)) {
    if (parts.objects && !parts.objects->triangles().faces.empty())
      objects_ = make_object_faces(parts);
  }

  TracedFaces prepare(std::span<const RayFan> fans) override {
    scanned_ = false;
    TracedFaces faces = exact_->prepare(fans);
    faces.version = version_of(Given::all_faces, faces.version);
    return faces;
  }

  TracedFaces prepare_runs(std::span<const RayFan> fans) override {
    const TracedFaces objects = objects_ ? objects_->prepare(fans) : TracedFaces{};
    if (objects_) scan_.keep_first(objects.triangles, objects.version, fans);
    if (!scan_.take(fans)) return prepare(fans);
    scanned_ = true;
    runs_.fans.assign(fans.begin(), fans.end());
    runs_.taken.assign(fans.size(), false);
    if (runs_.of_fans.size() < fans.size()) runs_.of_fans.resize(fans.size());
    for (std::size_t i = 0; i < fans.size(); ++i) {
      const bool seen = objects_ && objects.intersector->list_runs(fans[i], of_objects_) &&
                        of_objects_.size() > 0;
      if (seen)
        nearest_runs(fans[i], scan_.triangles(), scan_.runs(i), of_objects_, runs_.of_fans[i]);
      else
        std::swap(runs_.of_fans[i], scan_.runs(i));
    }
    return {&runs_, scan_.triangles(), version_of(Given::runs, scans_++), true};
  }

  TracedFaces prepare_bed(std::span<const RayFan> fans) override {
    if (!scan_.usable()) return prepare(fans);
    scanned_ = true;
    TracedFaces objects = objects_ ? objects_->prepare(fans) : TracedFaces{};
    objects.version = version_of(Given::bed, objects.version);
    objects.bed = grid_.get();
    return objects;
  }

  bool announce(std::span<const RayFan> fans, refine::SpareThreads& spare) override {
    return scanned_ || exact_->announce(fans, spare);
  }
  void reset() override {
    exact_->reset();
    if (objects_) objects_->reset();
  }

 private:
  /// Returns the runs of the last fans.
  class Runs final : public Intersector {
   public:
    void build(refine::Triangles) override { refuse(); }
    std::string_view code_path() const override { return "portable"; }
    void intersect(const RayFan&, std::span<Hit>) const override { refuse(); }
    void intersect(std::span<const Ray>, std::span<Hit>) const override { refuse(); }
    bool list_runs(const RayFan& fan, FanRuns& runs) const override {
      for (std::size_t i = 0; i < fans.size(); ++i)
        if (!taken[i] && fans[i].grid == fan.grid && fans[i].origin == fan.origin &&
            fans[i].array_axis == fan.array_axis && fans[i].middle == fan.middle) {
          std::swap(runs, of_fans[i]);
          taken[i] = true;
          return true;
        }
      refuse();
    }
    std::vector<RayFan> fans;
    // A face source has one thread at a time.
    mutable std::vector<FanRuns> of_fans;
    mutable std::vector<bool> taken;

   private:
    [[noreturn]] static void refuse() {
      throw std::logic_error("prepare_runs() gives the runs of its fans only, each once");
    }
  };

  enum class Given { nothing, all_faces, runs, bed };
  /// A number that differs from the last one if other faces are given, by their own version.
  std::uint64_t version_of(Given given, std::uint64_t own) {
    if (given_ != given || own_version_ != own) ++version_;
    given_ = given;
    own_version_ = own;
    return version_;
  }

  std::shared_ptr<const refine::HeightGrid> grid_;
  GridScan scan_;
  std::unique_ptr<FaceSource> exact_, objects_;
  FanRuns of_objects_;
  Runs runs_;
  bool scanned_ = false;  // whether the last faces were, or will be, scanned
  std::uint64_t scans_ = 0;
  Given given_ = Given::nothing;  // what was given last, and its own version
  std::uint64_t own_version_ = 0;
  std::uint64_t version_ = 0;
};

}  // namespace

std::unique_ptr<FaceSource> make_scanned_grid(const FaceSourceParts& parts,
                                              std::unique_ptr<FaceSource> exact) {
  return std::make_unique<ScannedGrid>(parts, std::move(exact));
}

}  // namespace ensonify::engine
