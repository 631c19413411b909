#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <string_view>
#include <utility>
#include <vector>

#include <ensonify/refine/triangle_mesh.h>

namespace ensonify::refine {

/// What repair() changed, one count per rule. The rules, in their order:
///
/// - Vertices at one place (or within weld_tolerance_m) move to the place of the first of them and
///   become one, unless a later rule splits them.
/// - A face without area (two corners are one vertex, or all are on a line, in double) is dropped.
/// - Of several faces with the same three vertices, in either orientation, the first stays.
/// - An edge of three or more faces does not connect its faces. They stay connected only if they
///   are in one fan at both ends of the edge.
/// - Neighbours of opposite orientation follow the majority of their component (in a tie, its first
///   face). A closed component is oriented outwards, so that its volume is positive, if its volume
///   is more than rounding.
/// - A one-sided surface (Möbius) is cut where breadth-first orientation from its first face fails.
/// - A vertex of several fans becomes one vertex per fan: the first keeps its number, others are
///   appended.
/// - A vertex that no remaining face uses is dropped.
///
/// Vertices are welded in their order: each vertex moves to the first earlier vertex within the
/// tolerance that has not moved itself. So no vertex moves farther than weld_tolerance_m, remaining
/// vertices are farther apart than that, and a chain of near neighbours does not become one place.
struct RepairReport {
  std::size_t welded_vertices = 0;        ///< joined to another vertex, or moved to its place
  std::size_t degenerate_faces = 0;       ///< dropped, without area
  std::size_t duplicate_faces = 0;        ///< dropped
  std::size_t non_manifold_edges = 0;     ///< of three or more faces, welded
  std::size_t unorientable_edges = 0;     ///< cut because their two faces cannot agree
  std::size_t split_vertices = 0;         ///< added where fans were separated
  std::size_t flipped_faces = 0;          ///< orientation reversed
  std::size_t unreferenced_vertices = 0;  ///< dropped

  /// The counts with their names.
  std::array<std::pair<std::string_view, std::size_t>, 8> entries() const {
    return {{{"welded_vertices", welded_vertices},
             {"degenerate_faces", degenerate_faces},
             {"duplicate_faces", duplicate_faces},
             {"non_manifold_edges", non_manifold_edges},
             {"unorientable_edges", unorientable_edges},
             {"split_vertices", split_vertices},
             {"flipped_faces", flipped_faces},
             {"unreferenced_vertices", unreferenced_vertices}}};
  }
  std::size_t total() const {
    std::size_t sum = 0;
    for (const auto& [name, count] : entries()) sum += count;
    return sum;
  }
};

/// A mesh that is manifold (with or without borders) and oriented, with the sources of its faces.
struct RepairedMesh {
  TriangleMesh mesh;
  std::vector<std::uint32_t> source_face;  ///< by face: the number in the source; ascending
  RepairReport report;
};

/// Returns for each vertex the number of the vertex whose place it takes; its own number if it
/// stays. weld_tolerance_m as for repair().
std::vector<std::uint32_t> weld(std::span<const Eigen::Vector3f> positions,
                                double weld_tolerance_m);

/// Makes any triangles manifold and consistently oriented: each edge has one face, or two in
/// opposite directions; each vertex has one fan, open or closed. Faces and vertices keep their
/// order, and a face its first corner. A mesh without faults (also a result of repair()) is
/// returned unchanged, with a report of zeros. weld_tolerance_m: vertices within this distance
/// become one; 0: only those at the same place; negative: none. Positions must be finite. Throws
/// std::invalid_argument if a face has a vertex that does not exist, weld_tolerance_m is not
/// finite, or there are 2^32 corners or vertices.
RepairedMesh repair(const TriangleMesh& mesh, double weld_tolerance_m = 0.0);
/// Repairs the mesh of a file. Also throws MeshError, with the file's name, if no face is left.
RepairedMesh repair_file(const TriangleMesh& mesh, double weld_tolerance_m,
                         const std::filesystem::path& file);

}  // namespace ensonify::refine
