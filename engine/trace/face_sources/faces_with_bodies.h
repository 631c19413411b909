#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include <Eigen/Geometry>

#include <ensonify/engine/trace/face_source.h>
#include <ensonify/refine/fan_volume.h>
#include <ensonify/refine/triangle_mesh.h>

namespace ensonify::engine {

/// A fixed face source plus bodies that move. The bodies that the fans can touch have a small tree.
/// It is rebuilt when one of them is added, removed or moved. The nearer hit of a body and of a
/// fixed face counts; at equal distance the hit of the fixed face. All faces of a body have the
/// number fixed_faces + body.
class FacesWithBodies final : public FaceSource {
 public:
  /// The faces of the fixed source have numbers below `fixed_faces`. The intersector that `parts`
  /// names builds the tree of the bodies.
  FacesWithBodies(std::unique_ptr<FaceSource> fixed, std::uint32_t fixed_faces,
                  const FaceSourceParts& parts);

  /// The lowest number that no body has.
  std::size_t free_body() const;
  /// Adds a body and returns its number, which is free_body(). `place` transforms the mesh's
  /// coordinates (m) to local ones. Throws refine::MeshError for a face with a vertex that does not
  /// exist or is not finite.
  std::size_t add(refine::TriangleMesh mesh, const Eigen::Isometry3d& place);
  void move(std::size_t body, const Eigen::Isometry3d& place);
  void remove(std::size_t body);
  bool has(std::size_t body) const {
    return body < bodies_.size() && !bodies_[body].mesh.faces.empty();
  }
  /// The fixed faces alone.
  FaceSource& fixed() { return *fixed_; }
  /// One more than the highest number of a body.
  std::size_t bodies() const { return bodies_.size(); }

  Faces prepare(std::span<const RayFan> fans) override;
  TracedFaces prepare_runs(std::span<const RayFan> fans) override;
  TracedFaces prepare_bed(std::span<const RayFan> fans) override;
  bool announce(std::span<const RayFan> fans, refine::SpareThreads& spare) override {
    return fixed_->announce(fans, spare);
  }
  void reset() override { fixed_->reset(); }

 private:
  struct Body {
    refine::TriangleMesh mesh;  // without faces: the number is free
    refine::Sphere around;      // in the mesh's coordinates
    Eigen::Isometry3d place = Eigen::Isometry3d::Identity();
    bool moved = true;  // since the tree was built
    refine::Sphere ball() const;
  };
  /// The nearer of two hits for each ray.
  class NearestOfTwo final : public Intersector {
   public:
    explicit NearestOfTwo(std::unique_ptr<Intersector> bodies) : bodies_(std::move(bodies)) {}
    void build(refine::Triangles triangles) override { bodies_->build(triangles); }
    std::string_view code_path() const override { return fixed_->code_path(); }
    void intersect(const RayFan& fan, std::span<Hit> hits) const override;
    void intersect(std::span<const Ray> rays, std::span<Hit> hits) const override;
    void set_fixed(const Intersector& fixed, std::size_t fixed_faces) {
      fixed_ = &fixed;
      fixed_faces_ = static_cast<std::uint32_t>(fixed_faces);
    }

   private:
    void merge(std::span<Hit> hits) const;
    std::unique_ptr<Intersector> bodies_;
    const Intersector* fixed_ = nullptr;
    std::uint32_t fixed_faces_ = 0;
    mutable std::vector<Hit> of_bodies_;  // a face source has one thread at a time
  };

  void find_wanted(std::span<const RayFan> fans);
  Faces with_bodies(const Faces& fixed);
  TracedFaces without_bodies(TracedFaces fixed);
  void gather();
  void join(const Faces& fixed);
  void release();

  std::unique_ptr<FaceSource> fixed_;
  std::uint32_t fixed_faces_;
  std::vector<Body> bodies_;
  NearestOfTwo nearest_;
  std::vector<refine::FanVolume> volumes_;
  refine::ViewTest view_;
  std::vector<std::size_t> wanted_, in_tree_;  // the bodies that the fans can touch
  refine::TriangleMesh seen_;                  // their faces, in local coordinates
  std::vector<std::uint32_t> seen_numbers_;
  refine::TriangleMesh all_;  // the fixed faces, then the bodies'
  std::vector<std::uint32_t> all_numbers_;
  std::size_t joined_positions_ = 0, joined_faces_ = 0;  // of the fixed source in all_
  std::uint64_t joined_version_ = 0;
  std::uint64_t version_ = 0;  // of what was joined; the fixed source's version is added
  bool joined_ = false;
};

}  // namespace ensonify::engine
