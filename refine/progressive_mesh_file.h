#pragma once

#include <cstdint>
#include <filesystem>
#include <span>
#include <string_view>

#include <ensonify/refine/progressive_mesh.h>

namespace ensonify::refine {

/// Of the format; a file of another version is refused.
inline constexpr std::uint32_t progressive_mesh_version = 1;

/// What the owner of a progressive mesh keeps beside it in the file.
struct ProgressiveMeshExtras {
  std::span<const std::uint16_t> tags = {};  ///< one a source face, or none at all
  std::string_view about = {};               ///< any bytes
  std::string_view key = {};                 ///< at most 64 bytes, none of them 0
};

/// Writes a progressive mesh into a file as write_file does: at any moment the file is the old one
/// or the whole new one. Throws std::system_error as that does, and std::invalid_argument for
/// arrays that do not fit together or are not finite, for fewer tags than source faces, and for
/// another key.
///
/// The file, in the byte order of the machine: a page of 4096 bytes with the header (Header in the
/// .cpp: magic, version, byte order, counts, bounds, world origin, key, where the sections are),
/// then one section an array, each from a page's start and zero to a page's end. The last section
/// has the XXH3-64 checksums of all others: of each one's groups of ProgressiveMesh::group nodes,
/// leaves or tags, then of the rest up to the page's end, which is the base mesh's part of the
/// faces, and all of the roots and of `about`. The header has its own checksum and that of the
/// checksums, so that each byte is covered. 68 bytes a vertex and some pages.
void save(const ProgressiveMesh& mesh, const ProgressiveMeshExtras& extras,
          const std::filesystem::path& file);

/// Maps such a file for reading. Header, checksums, roots, base faces and `about` are checked here
/// and all else at first touch, so this takes no time to speak of, and a change of the file's bytes
/// is noticed before they are used. Throws MeshError for what cannot be opened, is not such a file,
/// or is one of another version or byte order; DamagedFile for one that is truncated or changed.
ProgressiveMesh map_progressive_mesh(const std::filesystem::path& file);

}  // namespace ensonify::refine
