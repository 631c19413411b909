#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include <Eigen/Geometry>

#include <ensonify/engine/trace/face_source.h>
#include <ensonify/refine/fan_volume.h>
#include <ensonify/refine/triangle_mesh.h>

namespace ensonify::engine {

/// A surface that stands still, with bodies that move before it. The bodies that the fans can touch
/// have a small tree of their own, built when one of them came, went or moved; the nearer of the
/// two hits counts, the still surface's at one distance. A body's faces are all called by the
/// number of still faces plus the body's.
class FacesWithBodies final : public FaceSource {
 public:
  /// `still_faces` is how many numbers the still surface's faces have; the bodies' tree is of the
  /// intersector that the parts name.
  FacesWithBodies(std::unique_ptr<FaceSource> still, std::uint32_t still_faces,
                  const FaceSourceParts& parts);

  /// Returns the body's number: the lowest that is free. `place` takes the mesh's metres to local
  /// ones. Throws refine::MeshError for a face whose vertex is not there or not finite.
  std::size_t add(refine::TriangleMesh mesh, const Eigen::Isometry3d& place);
  void move(std::size_t body, const Eigen::Isometry3d& place);
  void remove(std::size_t body);
  bool has(std::size_t body) const {
    return body < bodies_.size() && !bodies_[body].mesh.faces.empty();
  }
  /// More than the highest number that a body has.
  std::size_t bodies() const { return bodies_.size(); }

  const Intersector& prepare(std::span<const RayFan> fans) override;
  bool expect(std::span<const RayFan> fans, refine::SpareThreads& spare) override {
    return still_->expect(fans, spare);
  }
  refine::Triangles triangles() const override;
  std::uint64_t version() const override { return version_ + still_->version(); }
  void reset() override { still_->reset(); }

 private:
  struct Body {
    refine::TriangleMesh mesh;  // of no faces: a free number
    refine::Sphere around;      // in the mesh's own metres
    Eigen::Isometry3d place = Eigen::Isometry3d::Identity();
    bool moved = true;  // since the tree was built
    refine::Sphere ball() const;
  };
  /// The nearer of two hits a ray.
  class NearestOfTwo final : public Intersector {
   public:
    explicit NearestOfTwo(std::unique_ptr<Intersector> bodies) : bodies_(std::move(bodies)) {}
    void build(refine::Triangles triangles) override { bodies_->build(triangles); }
    std::string_view code_path() const override { return still_->code_path(); }
    void intersect(const RayFan& fan, std::span<Hit> hits) const override;
    void intersect(std::span<const Ray> rays, std::span<Hit> hits) const override;
    void stand_before(const Intersector& still, std::size_t still_faces) {
      still_ = &still;
      still_faces_ = static_cast<std::uint32_t>(still_faces);
    }

   private:
    void merge(std::span<Hit> hits) const;
    std::unique_ptr<Intersector> bodies_;
    const Intersector* still_ = nullptr;
    std::uint32_t still_faces_ = 0;
    mutable std::vector<Hit> of_bodies_;  // one thread at a time uses a surface
  };

  void gather();
  void join(const refine::Triangles& still);

  std::unique_ptr<FaceSource> still_;
  std::uint32_t still_faces_;
  std::vector<Body> bodies_;
  NearestOfTwo nearer_;
  std::vector<refine::FanVolume> volumes_;
  refine::ViewTest view_;
  std::vector<std::size_t> wanted_, in_tree_;  // the bodies that the fans can touch
  refine::TriangleMesh seen_;                  // their faces, where they are
  std::vector<std::uint32_t> seen_numbers_;
  refine::TriangleMesh all_;  // the still surface's faces, then those
  std::vector<std::uint32_t> all_numbers_;
  std::size_t joined_positions_ = 0, joined_faces_ = 0;  // of the still surface in all_
  std::uint64_t joined_version_ = 0;
  std::uint64_t version_ = 0;  // of what was joined; counts on with the still surface's
  bool joined_ = false;
};

}  // namespace ensonify::engine
