#include <ensonify/engine/trace/check/hierarchy.h>

#include <algorithm>
#include <array>
#include <set>
#include <vector>

#include <Eigen/Geometry>

#include <ensonify/refine/parallel_for.h>

namespace ensonify::engine {
namespace {

using refine::ProgressiveMesh;
using Corners = std::array<Eigen::Vector3f, 3>;

/// Whether the spheres of all nodes above a leaf enclose the corners, computed in double.
bool enclosed(const ProgressiveMesh& mesh, std::uint32_t leaf, const Corners& corners) {
  const auto after = std::ranges::upper_bound(mesh.roots, leaf);
  const auto root = static_cast<std::uint32_t>(after - mesh.roots.begin()) - 1;
  std::uint32_t lo = mesh.roots[root], hi = mesh.end_of(root), node = lo - root;
  while (hi - lo > 1) {
    const refine::Sphere& sphere = mesh.spheres[node];
    const Eigen::Vector3d centre = sphere.centre.cast<double>();
    for (const Eigen::Vector3f& corner : corners)
      if (!((corner.cast<double>() - centre).norm() <= double{sphere.radius})) return false;
    const std::uint32_t mid = mesh.mid_of(node, lo, hi);
    if (leaf < mid) {
      node += 1;
      hi = mid;
    } else {
      node += mid - lo;
      lo = mid;
    }
  }
  return true;
}

bool is_sound(refine::Triangles mesh, const ProgressiveMesh& progressive, std::size_t slot) {
  const std::uint32_t number = progressive.source_face[slot];
  if (number >= mesh.faces.size()) return false;
  Corners corners;
  for (std::size_t k = 0; k < 3; ++k) {
    corners[k] = progressive.points[progressive.faces[slot][k]];
    if (corners[k] != mesh.positions[mesh.faces[number][k]]) return false;
  }
  return std::ranges::all_of(progressive.faces[slot], [&](std::uint32_t leaf) {
    return enclosed(progressive, leaf, corners);
  });
}

/// Counts the faces that are left out, by the reason.
void judge_missing(refine::Triangles mesh, const std::vector<bool>& is_there,
                   AgreementCounts& tally) {
  const auto key = [&](std::uint32_t face) {
    refine::Face vertices = mesh.faces[face];
    std::ranges::sort(vertices);
    return vertices;
  };
  std::set<refine::Face> wanted;
  for (std::uint32_t face = 0; face < mesh.faces.size(); ++face)
    if (!is_there[face]) wanted.insert(key(face));
  if (wanted.empty()) return;
  std::set<refine::Face> found;  // vertices of earlier faces that are there
  for (std::uint32_t face = 0; face < mesh.faces.size(); ++face) {
    const refine::Face vertices = key(face);
    if (!wanted.contains(vertices)) continue;
    if (is_there[face]) {
      found.insert(vertices);
      continue;
    }
    const Eigen::Vector3d a = mesh.corner(face, 0);
    const bool flat = (mesh.corner(face, 1) - a).cross(mesh.corner(face, 2) - a).isZero(0.0);
    Verdict verdict = Verdict::unexplained;
    if (found.contains(vertices)) verdict = Verdict::tie;
    if (flat) verdict = Verdict::coplanar;
    ++tally.rays;
    ++tally.verdicts[static_cast<std::size_t>(verdict)];
  }
}

}  // namespace

AgreementCounts compare_faces(refine::Triangles mesh, const ProgressiveMesh& progressive,
                              int threads) {
  progressive.verify_all();
  constexpr std::size_t part = 1 << 14;
  const std::size_t slots = progressive.faces.size(), parts = (slots + part - 1) / part;
  std::vector<std::uint64_t> unsound(parts, 0), sound(parts, 0);
  refine::parallel_for(parts, threads, [&](std::size_t which, int) {
    for (std::size_t slot = which * part; slot < std::min((which + 1) * part, slots); ++slot)
      if (progressive.faces[slot][0] != ProgressiveMesh::none)
        ++(is_sound(mesh, progressive, slot) ? sound : unsound)[which];
  });
  AgreementCounts tally;
  for (std::size_t which = 0; which < parts; ++which) {
    tally.verdicts[static_cast<std::size_t>(Verdict::same)] += sound[which];
    tally.verdicts[static_cast<std::size_t>(Verdict::unexplained)] += unsound[which];
    tally.rays += sound[which] + unsound[which];
  }
  std::vector<bool> is_there(mesh.faces.size(), false);
  for (std::size_t slot = 0; slot < slots; ++slot) {
    const std::uint32_t number = progressive.source_face[slot];
    if (progressive.faces[slot][0] == ProgressiveMesh::none || number >= mesh.faces.size())
      continue;
    if (is_there[number]) ++tally.verdicts[static_cast<std::size_t>(Verdict::unexplained)];
    tally.rays += is_there[number];
    is_there[number] = true;
  }
  judge_missing(mesh, is_there, tally);
  return tally;
}

}  // namespace ensonify::engine
