#pragma once

#include <filesystem>
#include <functional>
#include <string>

#include <ensonify/engine/seafloor/seafloor.h>

namespace ensonify::engine {

/// Builds a seafloor's progressive mesh, which replaces its mesh. Where the mesh is not manifold,
/// vertices are split; the faces stay where they are, so rays hit the same places. The result does
/// not depend on the number of threads. `stop_check` and exceptions as of refine::build_by_tiles().
void analyse(Seafloor& seafloor, int threads, const std::function<void()>& stop_check = {});

/// Writes an analysed seafloor with a key of what it was made from. Throws std::system_error.
void save_analysed(const Seafloor& seafloor, const std::string& key,
                   const std::filesystem::path& file);

/// Maps a file that save_analysed() wrote. Parts that no ping touches are never read; other parts
/// are checked before use. Throws refine::MeshError for a damaged file or a file of another kind.
Seafloor open_analysed(const std::filesystem::path& file);
/// As above. Throws refine::MeshError also if the file has another key.
Seafloor open_analysed(const std::filesystem::path& file, const std::string& key);

/// The inverse of analyse(): turns an analysed seafloor back into a mesh. Faces get their original
/// numbers, and vertices get the order of the progressive mesh's leaves. Reads the whole file, and
/// throws refine::MeshError if the file is damaged.
void restore_mesh(Seafloor& seafloor);

}  // namespace ensonify::engine
