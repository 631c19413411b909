#pragma once

#include <filesystem>

#include <ensonify/refine/triangle_mesh.h>

namespace ensonify::refine {

/// Reads the PLY that write_ply makes: binary little-endian, vertices `double x y z` in world
/// metres, faces `list uchar int vertex_indices` of three. The mesh's world origin is the middle of
/// its bounds, rounded to whole metres. Other PLY layouts are refused by name. Throws MeshError.
TriangleMesh read_ply(const std::filesystem::path& file);

/// Writes a mesh as that PLY, through a temporary. Throws std::system_error (see write_file).
void write_ply(const std::filesystem::path& file, const TriangleMesh& mesh);

}  // namespace ensonify::refine
