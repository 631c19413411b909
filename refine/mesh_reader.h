#pragma once

#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <string_view>

#include <ensonify/refine/triangle_mesh.h>

namespace ensonify::refine {

enum class MeshFormat { ply, obj, stl, off };

/// The format by a file name's extension: .ply, .obj, .stl or .off in any case; none for others.
std::optional<MeshFormat> mesh_format(const std::filesystem::path& file);

/// What is wrong with a file that is named like a mesh or a solid of another format, and what to
/// do; empty for others.
std::string fault_of_other_mesh(const std::filesystem::path& file);

/// Reads a mesh file in the format of its extension: PLY (ASCII, both binary orders), OBJ, STL
/// (ASCII and binary), OFF (text). Vertices and faces keep the file's order; equal corners of an
/// STL become one vertex, in the order of first appearance; polygons are split into fans from their
/// first corner, concave ones by cutting ears off. Nothing is repaired (see mesh_repair.h). The
/// world origin is the middle of the bounds of the vertices that faces use, rounded to whole
/// metres; it is subtracted in double, before the conversion to float.
///
/// The file is not trusted: sizes are compared with the file's before memory is allocated, every
/// number is finite and within 1e18, every index is in range (an OBJ's may name a later vertex),
/// every polygon has at least three corners, and only blank lines follow the end. Texture, colours,
/// normals, materials, groups, lines and points are ignored; triangle strips, free-form surfaces
/// and binary OFF are refused by name. Throws MeshError with the line (or byte) of the fault, for a
/// mesh without faces, and for a file that cannot be read. `stop_check` is called while the file is
/// read; what it throws ends that.
TriangleMesh read_mesh(const std::filesystem::path& file,
                       const std::function<void()>& stop_check = {});

/// The same from bytes; `name` is the file's name for messages.
TriangleMesh parse_mesh(std::string_view bytes, MeshFormat format, std::string_view name);

/// Writes a mesh as a binary little-endian PLY: vertices `double x y z` in world metres, faces
/// `list uchar int vertex_indices`. Throws std::system_error (see write_file).
void write_ply(const std::filesystem::path& file, const TriangleMesh& mesh);

}  // namespace ensonify::refine
