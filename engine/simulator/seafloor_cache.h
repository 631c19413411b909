#pragma once

#include <cstdint>
#include <filesystem>
#include <string>

#include <ensonify/engine/scene/scene.h>

namespace ensonify::engine {

// Extensions of what the cache holds under a key: analysed meshes, files of tiles, and folders of
// the clusters over them.
inline constexpr const char* cached_extension = ".mesh";
inline constexpr const char* tiles_extension = ".tiles";
inline constexpr const char* clusters_extension = ".clusters";

/// A hash, of 32 digits, of all that an analysed seafloor depends on: the scene's seafloor and
/// objects, the contents and names of their files (not their folders), the seed, and the versions
/// of the program's parts and libraries that make it.
std::string seafloor_key(const Scene& scene);

/// The file in a cache that a scene's analysed seafloor is taken from, or kept in.
std::filesystem::path cache_file(const Scene& scene, const std::filesystem::path& cache);

/// The path of the file or folder that a cache keeps under a key.
std::filesystem::path file_of(const std::filesystem::path& cache, const std::string& key,
                              const char* extension);

/// Removes the entries that were used longest ago until the rest is within the limit. The files of
/// the key in use stay, whatever their size.
void trim_cache(const std::filesystem::path& cache, std::uintmax_t limit_bytes,
                const std::string& key);

}  // namespace ensonify::engine
