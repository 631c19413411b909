#pragma once

#include <filesystem>
#include <string>

#include <ensonify/engine/seafloor/seafloor.h>

namespace ensonify::engine {

/// The analysis phase: makes a seafloor's progressive mesh, which takes its mesh's place. Where the
/// mesh is not manifold, vertices are parted, which costs a ray nothing. The result is the same on
/// any number of threads. Throws what the builder throws.
void analyse(Seafloor& seafloor, int threads);

/// Keeps an analysed seafloor in a file, under a key that says what it was made from. Throws
/// std::system_error.
void save_analysed(const Seafloor& seafloor, const std::string& key,
                   const std::filesystem::path& file);

/// Such a seafloor, mapped: what a ping does not touch is not read, what it touches is checked
/// first. Throws refine::MeshError for a file that is not one, or damaged.
Seafloor open_analysed(const std::filesystem::path& file);
/// The same if it has this key, else refine::MeshError.
Seafloor open_analysed(const std::filesystem::path& file, const std::string& key);

/// The way back: all faces of an analysed seafloor as its mesh again, by their numbers. Vertices
/// come in the order of leaves. Reads the whole file; throws refine::MeshError where it is damaged.
void restore_mesh(Seafloor& seafloor);

}  // namespace ensonify::engine
