#pragma once

#include <filesystem>
#include <optional>
#include <string_view>

#include <ensonify/refine/triangle_mesh.h>

namespace ensonify::refine {

enum class MeshFormat { ply, obj, stl, off };

/// The format that a file's name promises: .ply, .obj, .stl or .off, in any case; none for others.
std::optional<MeshFormat> mesh_format(const std::filesystem::path& file);

/// Reads a mesh that somebody brought, in the format of its name: PLY (ASCII, both binary orders),
/// OBJ, STL (ASCII and binary), OFF (text). Vertices come as in the file, an STL's equal corners as
/// one, in the order of first appearance; faces come in the file's order, polygons fanned in place
/// from their first corner. Nothing is repaired (see mesh_repair.h). The world origin is the middle
/// of the bounds of what faces use, rounded to whole metres; it is taken off in double, before the
/// float.
///
/// Nothing in the file is trusted: sizes are held against the file before memory is asked for,
/// every number is finite and within 1e18, every index in range (an OBJ's may name a vertex still
/// to come), every polygon has three corners or more, and nothing follows the end but blank lines.
/// Texture, colours, normals, materials, groups, lines and points are passed over; triangle strips,
/// free-form surfaces and binary OFF are refused by name. Throws MeshError with the line (or byte)
/// where that does not hold, for a mesh without a face, and for a file that cannot be read.
TriangleMesh read_mesh(const std::filesystem::path& file);

/// The same from bytes; `name` stands for the file in messages.
TriangleMesh parse_mesh(std::string_view bytes, MeshFormat format, std::string_view name);

/// Writes a mesh as a binary little-endian PLY: vertices `double x y z` in world metres, faces
/// `list uchar int vertex_indices`; through a temporary. Throws std::system_error (see write_file).
void write_ply(const std::filesystem::path& file, const TriangleMesh& mesh);

}  // namespace ensonify::refine
