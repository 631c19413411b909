#include <ensonify/engine/trace/check/tetrahedron.h>

#include <algorithm>
#include <cstddef>

namespace ensonify::engine {

Tetrahedron::Tetrahedron(const RayFan& fan, std::span<const Hit> hits, const RandomStream& stream) {
  std::array<double, 6> drawn;
  stream.uniform(drawn);
  const auto pick = [&](double u, std::size_t of) {
    return std::min(static_cast<std::size_t>(u * static_cast<double>(of)), of - 1);
  };
  const std::size_t plane = fan.planes() / 2, elevation = pick(drawn[0], fan.elevations());
  const Hit& hit = hits[plane * fan.elevations() + elevation];
  const double range_m = (0.2 + 0.75 * drawn[1]) * (hit ? hit.t : fan.range_m);
  const Ray ray = fan.ray(plane, elevation);
  place =
      Eigen::Translation3d(ray.origin + range_m * ray.direction) *
      Eigen::AngleAxisd(6.0 * drawn[2], Eigen::Vector3d(drawn[3], drawn[4], drawn[5]).normalized());
  const auto size_m = static_cast<float>(0.02 * fan.range_m);
  const std::array<Eigen::Vector3f, 4> corners{
      Eigen::Vector3f(size_m, size_m, size_m), Eigen::Vector3f(size_m, -size_m, -size_m),
      Eigen::Vector3f(-size_m, size_m, -size_m), Eigen::Vector3f(-size_m, -size_m, size_m)};
  for (std::size_t i = 0; i < 4; ++i)
    faces[i] = {.positions = {corners[i], corners[(i + 1) % 4], corners[(i + 2) % 4]},
                .faces = {{0, 1, 2}}};
}

void add_bodies(std::span<const Tetrahedron> bodies, FacesWithBodies& surface) {
  for (const Tetrahedron& body : bodies)
    for (const refine::TriangleMesh& face : body.faces) surface.add(face, body.place);
}

void replace_bodies(std::span<const Tetrahedron> bodies, FacesWithBodies& surface) {
  std::size_t number = 0;
  for (const Tetrahedron& body : bodies)
    for (const refine::TriangleMesh& face : body.faces) {
      if (number % 3 == 1) {
        surface.remove(number);
        surface.add(face, body.place);  // gets the same number
      } else {
        surface.move(number, body.place);
      }
      ++number;
    }
}

void append(std::span<const Tetrahedron> bodies, std::uint32_t number, NearFaces& near) {
  for (const Tetrahedron& body : bodies)
    for (const refine::TriangleMesh& face : body.faces) {
      std::array<Eigen::Vector3f, 3> corners;
      for (std::size_t k = 0; k < 3; ++k)
        corners[k] = (body.place * face.positions[k].cast<double>()).cast<float>();
      near.add(corners, number++);
    }
}

}  // namespace ensonify::engine
