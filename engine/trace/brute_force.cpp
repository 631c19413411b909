#include <ensonify/engine/trace/brute_force.h>

#include <Eigen/Geometry>

namespace ensonify::engine {
namespace {

class BruteForce final : public Intersector {
 public:
  explicit BruteForce(refine::Triangles triangles) : triangles_(triangles) {}

  std::string_view code_path() const override { return "portable"; }

  void intersect(const RayFan& fan, std::span<Hit> hits) const override {
    check_fan(fan, hits);
    for (std::size_t plane = 0; plane < fan.planes(); ++plane)
      for (std::size_t elevation = 0; elevation < fan.elevations(); ++elevation)
        hits[plane * fan.elevations() + elevation] =
            fan.grid->within_beam(plane, elevation) ? nearest(fan.ray(plane, elevation)) : Hit{};
  }

  void intersect(std::span<const Ray> rays, std::span<Hit> hits) const override {
    for (std::size_t i = 0; i < rays.size(); ++i) {
      check_ray(rays[i]);
      hits[i] = nearest(rays[i]);
    }
  }

 private:
  Hit nearest(const Ray& ray) const {
    Hit best;
    for (std::uint32_t face = 0; face < triangles_.faces.size(); ++face) meet(ray, face, best);
    return best;
  }

  // The ray's line passes an edge (p, q), seen from the origin, on the side that d . (q x p) tells.
  // Swapping p and q flips exactly that sign, rounding included.
  void meet(const Ray& ray, std::uint32_t face, Hit& best) const {
    const Eigen::Vector3d a = triangles_.corner(face, 0) - ray.origin;
    const Eigen::Vector3d b = triangles_.corner(face, 1) - ray.origin;
    const Eigen::Vector3d c = triangles_.corner(face, 2) - ray.origin;
    const double across_a = ray.direction.dot(c.cross(b));
    const double across_b = ray.direction.dot(a.cross(c));
    const double across_c = ray.direction.dot(b.cross(a));
    const bool front = across_a >= 0.0 && across_b >= 0.0 && across_c >= 0.0;
    const bool back = across_a <= 0.0 && across_b <= 0.0 && across_c <= 0.0;
    if (!front && !back) return;
    const double volume = across_a + across_b + across_c;
    const Eigen::Vector3d normal = (b - a).cross(c - a);
    const double approach = normal.dot(ray.direction);
    if (volume == 0.0 || approach == 0.0) return;
    const double t = normal.dot(a) / approach;
    if (t >= ray.t_min && t <= ray.t_max && t < best.t)
      best = {face, t, across_b / volume, across_c / volume};
  }

  refine::Triangles triangles_;
};

}  // namespace

std::unique_ptr<Intersector> make_brute_force(refine::Triangles triangles) {
  return std::make_unique<BruteForce>(triangles);
}

}  // namespace ensonify::engine
