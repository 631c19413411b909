#include <ensonify/engine/trace/exact/pluecker.h>

#include <ensonify/engine/trace/exact/pluecker_faces.h>
#include <ensonify/engine/trace/ray_by_ray.h>

namespace ensonify::engine {
namespace {

class Pluecker final : public RayByRay {
 public:
  using RayByRay::RayByRay;
  void build(refine::Triangles triangles) override {
    faces_.build(triangles, stop_check());
    tree_.build(
        faces_.count(), [this](std::uint32_t face) { return faces_.box(face); }, stop_check());
  }

  std::string_view code_path() const override { return "portable"; }

 private:
  Hit nearest(const Ray& ray) const override {
    PlueckerQuery query(ray);
    tree_.walk(query.line(), query.limit(), [&](std::uint32_t face) { faces_.meet(query, face); });
    return query.nearest();
  }

  PlueckerFaces faces_;
  BoxTree tree_;
};

class BruteForce final : public RayByRay {
 public:
  using RayByRay::RayByRay;
  void build(refine::Triangles triangles) override { faces_.build(triangles, stop_check()); }

  std::string_view code_path() const override { return "portable"; }

 private:
  Hit nearest(const Ray& ray) const override {
    PlueckerQuery query(ray);
    for (std::uint32_t face = 0; face < faces_.count(); ++face) faces_.meet(query, face);
    return query.nearest();
  }

  PlueckerFaces faces_;
};

}  // namespace

std::unique_ptr<Intersector> make_pluecker(const IntersectorOptions& options) {
  return std::make_unique<Pluecker>(options);
}

std::unique_ptr<Intersector> make_brute_force(const IntersectorOptions& options) {
  return std::make_unique<BruteForce>(options);
}

}  // namespace ensonify::engine
