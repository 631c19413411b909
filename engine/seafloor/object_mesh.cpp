#include <ensonify/engine/seafloor/object_mesh.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <limits>
#include <stdexcept>
#include <type_traits>

namespace ensonify::engine {
namespace {

/// The bytes before the positions and faces of a mesh.
struct Header {
  std::array<double, 3> place;
  double rounding_m;
  std::uint64_t positions, faces;
};
static_assert(sizeof(Header) == 48 && std::is_trivially_copyable_v<Header>);
static_assert(sizeof(Eigen::Vector3d) == 24 && sizeof(refine::Face) == 12);

/// Moves the first `count` bytes to `to`.
void take(std::string_view& bytes, void* to, std::size_t count) {
  if (count > bytes.size()) throw std::out_of_range("objects");
  if (count > 0) std::memcpy(to, bytes.data(), count);
  bytes.remove_prefix(count);
}

/// Moves the bytes of the first `count` items to `to`.
template <class T>
void take(std::string_view& bytes, std::vector<T>& to, std::uint64_t count) {
  if (count > bytes.size() / sizeof(T)) throw std::out_of_range("objects");
  to.resize(count);
  take(bytes, to.data(), count * sizeof(T));
}

bool is_sound(const ObjectMesh& mesh) {
  const auto finite = [](const Eigen::Vector3d& place) { return place.allFinite(); };
  return finite(mesh.place) && std::isfinite(mesh.rounding_m) &&
         std::ranges::all_of(mesh.positions, finite) &&
         std::ranges::all_of(mesh.faces, [&](const refine::Face& face) {
           return std::ranges::max(face) < mesh.positions.size();
         });
}

}  // namespace

ObjectMesh::ObjectMesh(const refine::TriangleMesh& mesh) : faces(mesh.faces) {
  positions.reserve(mesh.positions.size());
  for (const Eigen::Vector3f& p : mesh.positions) positions.emplace_back(p.cast<double>());
  // The error of a float x is at most half a unit of its last place. This unit is between
  // epsilon x / 2 and epsilon x, so the standard deviation is 0.14 to 0.29 epsilon x.
  const refine::Bounds box = refine::bounds(mesh);
  const Eigen::Vector3f farthest = box.lowest.cwiseAbs().cwiseMax(box.highest.cwiseAbs());
  rounding_m = 0.25 * std::numeric_limits<float>::epsilon() * double(farthest.norm());
}

Eigen::AlignedBox3d ObjectMesh::box() const {
  Eigen::AlignedBox3d box;
  for (const refine::Face& face : faces)
    for (const std::uint32_t vertex : face) box.extend(positions[vertex]);
  if (box.isEmpty()) box.extend(Eigen::Vector3d::Zero());
  return box;
}

refine::TriangleMesh ObjectMesh::in_floats() const {
  refine::TriangleMesh mesh{.positions = {}, .faces = faces};
  mesh.positions.reserve(positions.size());
  for (const Eigen::Vector3d& p : positions) mesh.positions.emplace_back((p + place).cast<float>());
  return mesh;
}

std::string bytes_of(const std::vector<ObjectMesh>& meshes) {
  std::string bytes;
  const auto add = [&](const void* from, std::size_t count) {
    bytes.append(static_cast<const char*>(from), count);
  };
  for (const ObjectMesh& mesh : meshes) {
    const Header header{{mesh.place.x(), mesh.place.y(), mesh.place.z()},
                        mesh.rounding_m,
                        mesh.positions.size(),
                        mesh.faces.size()};
    add(&header, sizeof header);
    add(mesh.positions.data(), mesh.positions.size() * sizeof(Eigen::Vector3d));
    add(mesh.faces.data(), mesh.faces.size() * sizeof(refine::Face));
  }
  return bytes;
}

std::vector<ObjectMesh> object_meshes_of(std::string_view bytes) {
  std::vector<ObjectMesh> meshes;
  while (!bytes.empty()) {
    Header header{};
    take(bytes, &header, sizeof header);
    ObjectMesh& mesh = meshes.emplace_back();
    mesh.place = {header.place[0], header.place[1], header.place[2]};
    mesh.rounding_m = header.rounding_m;
    take(bytes, mesh.positions, header.positions);
    take(bytes, mesh.faces, header.faces);
    if (!is_sound(mesh)) throw std::out_of_range("objects");
  }
  return meshes;
}

}  // namespace ensonify::engine
