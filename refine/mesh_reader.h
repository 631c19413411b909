#pragma once

#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <string_view>

#include <ensonify/refine/triangle_mesh.h>

namespace ensonify::refine {

enum class MeshFormat { ply, obj, stl, off };

/// The format of a file with the extension .ply, .obj, .stl or .off, in any case; none for others.
std::optional<MeshFormat> mesh_format(const std::filesystem::path& file);

/// What is wrong with a file that has the extension of another format of meshes or solids, and what
/// to do; empty for others.
std::string fault_of_other_mesh(const std::filesystem::path& file);

/// Reads a mesh file in the format of its extension: PLY (ASCII, both binary orders), OBJ, STL
/// (ASCII and binary), OFF (text). Vertices and faces keep the file's order. Equal corners of an
/// STL become one vertex, in the order of first appearance. Polygons are split into fans from their
/// first corner, concave ones by cutting ears off. Nothing is repaired (see mesh_repair.h). The
/// world origin is the middle of the box around the vertices that faces use, rounded to whole
/// metres. It is subtracted in double, before positions become float.
///
/// The file is not trusted. Sizes are compared with the file's before memory is allocated. Every
/// number must be finite and within 1e18, every index in range (in an OBJ it may be the index of a
/// later vertex), every polygon must have at least three corners, and only blank lines may follow
/// the end. Texture, colours, normals, materials, groups, lines and points are ignored; triangle
/// strips, free-form surfaces and binary OFF are refused by name. Throws MeshError with the line
/// (or byte) of the fault, for a mesh without faces, and for a file that cannot be read.
/// `stop_check` is called while the file is read; its exceptions end the reading.
TriangleMesh read_mesh(const std::filesystem::path& file,
                       const std::function<void()>& stop_check = {});

/// Reads a mesh from the bytes of a file; `name` is the file's name for messages.
TriangleMesh parse_mesh(std::string_view bytes, MeshFormat format, std::string_view name);

/// Writes a mesh as a binary little-endian PLY: vertices `double x y z` in world metres, faces
/// `list uchar int vertex_indices`. Throws std::system_error (see write_file).
void write_ply(const std::filesystem::path& file, const TriangleMesh& mesh);

}  // namespace ensonify::refine
