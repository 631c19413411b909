#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string_view>
#include <utility>
#include <vector>

#include <ensonify/refine/triangle_mesh.h>

namespace ensonify::refine {

/// What repair() changed, one count a policy. Policies, in the order in which they act:
///
/// | fault                                    | what is done |
/// |------------------------------------------|------------------------------------------------------|
/// | vertices at one place (or within weld_tolerance_m) | each takes the place of the first, and
/// they become   | |                                          | one, unless what follows parts them
/// | | a face without area (two corners are one | dropped | | or all three on a line, in double) |
/// | | a face whose three vertices another has, | dropped, the first stays | | whichever way it
/// turns                   |                                                      | | an edge of
/// three or more faces           | not a way from face to face: faces stay together     | | | there
/// only where they are one fan at both ends       | | neighbours turned against each other     |
/// all turn with the majority of their component (in a  | | | tie, its first face); a closed
/// component outwards,   | |                                          | its volume positive, if it
/// has one beyond rounding   | | a surface with one side (Möbius)         | cut where turning
/// breadth-first, from its first face | |                                          | on, closes
/// wrongly                                   | | a vertex where several fans meet         | one
/// vertex a fan: the first keeps its number, others | |                                          |
/// are appended                                         | | a vertex that no face (left) uses |
/// dropped                                              |
///
/// Welding parts from the first vertex on: each joins the first earlier one within reach that has
/// joined none. So no vertex moves farther than weld_tolerance_m, those left are farther apart than
/// it, and a chain of near neighbours does not collapse into one place.
struct RepairReport {
  std::size_t welded_vertices = 0;        ///< joined to another, or moved to its place
  std::size_t degenerate_faces = 0;       ///< dropped for want of area
  std::size_t duplicate_faces = 0;        ///< dropped
  std::size_t non_manifold_edges = 0;     ///< of three or more faces, welded
  std::size_t unorientable_edges = 0;     ///< cut since their two faces cannot agree
  std::size_t split_vertices = 0;         ///< added where fans were parted
  std::size_t flipped_faces = 0;          ///< turned round
  std::size_t unreferenced_vertices = 0;  ///< dropped

  /// Every count with its name.
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

/// A mesh that is manifold (with or without borders) and oriented, and where its faces came from.
struct RepairedMesh {
  TriangleMesh mesh;
  std::vector<std::uint32_t> source_face;  ///< one a face: its number before; ascending
  RepairReport report;
};

/// The places that vertices take: for each the number of the vertex whose place it is, its own
/// where it stays. weld_tolerance_m as for repair().
std::vector<std::uint32_t> weld(std::span<const Eigen::Vector3f> positions,
                                double weld_tolerance_m);

/// Makes any triangles manifold and consistently oriented: of each edge one face, or two in
/// opposite directions; round each vertex one fan, open or closed. Faces keep their order, vertices
/// too, and a face its first corner. What is in order comes back equal, and a report of zeros says
/// so: that holds for what repair() gave, too. weld_tolerance_m: vertices this close become one; 0:
/// only those at the same place; negative: none. Positions are finite. Throws std::invalid_argument
/// if a face names a vertex that is not there, weld_tolerance_m is not finite, or there are 2^32
/// corners or vertices.
RepairedMesh repair(const TriangleMesh& mesh, double weld_tolerance_m = 0.0);

}  // namespace ensonify::refine
