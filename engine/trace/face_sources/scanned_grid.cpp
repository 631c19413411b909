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

  Faces prepare(std::span<const RayFan> fans) override {
    scanned_ = false;
    Faces faces = exact_->prepare(fans);
    faces.version = version_of(Given::all_faces, faces.version);
    return faces;
  }

  TracedFaces prepare_runs(std::span<const RayFan> fans) override {
    const Faces objects = objects_ ? objects_->prepare(fans) : Faces{};
    if (objects_) scan_.keep_first(objects.triangles, objects.version, fans);
    if (!scan_.take(fans)) return prepare(fans);
    scanned_ = true;
    if (runs_.size() < fans.size()) runs_.resize(fans.size());
    for (std::size_t i = 0; i < fans.size(); ++i) {
      const bool seen = objects_ && objects.intersector->list_runs(fans[i], of_objects_) &&
                        of_objects_.size() > 0;
      if (seen)
        nearest_runs(fans[i], scan_.triangles(), scan_.runs(i), of_objects_, runs_[i]);
      else
        std::swap(runs_[i], scan_.runs(i));
    }
    return FoundRuns{scan_.triangles(), std::span(runs_).first(fans.size())};
  }

  TracedFaces prepare_bed(std::span<const RayFan> fans) override {
    if (!scan_.usable()) return prepare(fans);
    scanned_ = true;
    Faces objects = objects_ ? objects_->prepare(fans) : Faces{};
    objects.version = version_of(Given::objects, objects.version);
    return BedAndObjects{grid_.get(), objects, this, fans};
  }

  bool announce(std::span<const RayFan> fans, refine::SpareThreads& spare) override {
    return scanned_ || exact_->announce(fans, spare);
  }
  void reset() override {
    exact_->reset();
    if (objects_) objects_->reset();
  }

 private:
  enum class Given { nothing, all_faces, objects };
  /// A number that changes if the kind of the given faces, or their own version `own`, changes.
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
  std::vector<FanRuns> runs_;     // by fan
  bool scanned_ = false;          // whether the last faces were, or will be, scanned
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
