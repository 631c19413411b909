#include <ensonify/engine/trace/exact/pluecker.h>

#include <ensonify/engine/trace/exact/pluecker_faces.h>
#include <ensonify/engine/trace/ray_by_ray.h>

namespace ensonify::engine {
namespace {

class Pluecker final : public RayByRay {
 public:
  void build(refine::Triangles triangles) override {
    faces_.build(triangles);
    std::vector<Box> boxes(faces_.count());
    for (std::uint32_t face = 0; face < faces_.count(); ++face) boxes[face] = faces_.box(face);
    tree_.build(boxes);
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

}  // namespace

std::unique_ptr<Intersector> make_pluecker(const IntersectorOptions&) {
  return std::make_unique<Pluecker>();
}

}  // namespace ensonify::engine
