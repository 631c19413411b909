#pragma once

#include <filesystem>
#include <functional>
#include <string>

#include <ensonify/engine/seafloor/seafloor.h>

namespace ensonify::engine {

/// The analysis phase: builds a seafloor's progressive mesh, which replaces its mesh. Where the
/// mesh is not manifold, vertices are split; the faces stay where they are, so rays meet the same
/// surface. The result does not depend on the number of threads. Throws what the builder throws.
/// `stop_check` as in refine::build_by_tiles().
void analyse(Seafloor& seafloor, int threads, const std::function<void()>& stop_check = {});

/// Writes an analysed seafloor to a file, with a key that identifies what it was made from. Throws
/// std::system_error.
void save_analysed(const Seafloor& seafloor, const std::string& key,
                   const std::filesystem::path& file);

/// Maps such a file: parts that no ping touches are never read, parts that are touched are checked
/// first. Throws refine::MeshError for a file of another kind or a damaged one.
Seafloor open_analysed(const std::filesystem::path& file);
/// The same, if the file has this key; throws refine::MeshError otherwise.
Seafloor open_analysed(const std::filesystem::path& file, const std::string& key);

/// The inverse of analyse(): turns an analysed seafloor back into a mesh. Faces get their original
/// numbers, vertices the order of the hierarchy's leaves. Reads the whole file; throws
/// refine::MeshError where it is damaged.
void restore_mesh(Seafloor& seafloor);

}  // namespace ensonify::engine
