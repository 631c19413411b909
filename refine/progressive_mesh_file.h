#pragma once

#include <cstdint>
#include <filesystem>
#include <span>
#include <string_view>

#include <ensonify/refine/progressive_mesh.h>

namespace ensonify::refine {

/// The version of the format; files of other versions are refused.
inline constexpr std::uint32_t progressive_mesh_version = 1;

/// Data that the owner of a progressive mesh stores in its file.
struct ProgressiveMeshExtras {
  std::span<const std::uint16_t> tags = {};  ///< one per source face, or empty
  std::string_view about = {};               ///< any bytes
  std::string_view key = {};                 ///< at most 64 bytes, none of them 0
};

/// Writes a progressive mesh into a file as write_file does: at any moment the file is the old one
/// or the complete new one. Throws std::system_error as write_file does, and std::invalid_argument
/// for arrays that do not fit together or are not finite, for fewer tags than source faces, and for
/// a key that is too long or contains 0.
///
/// The file is in the byte order of the machine. Its first page of 4096 bytes has the header
/// (MeshHeader in the .cpp: magic, version, byte order, counts, bounds, world origin, key, the
/// places of the sections). One section per array follows; each starts at a page and is padded with
/// zeros to a page's end. The last section has the XXH3-64 checksums of all other sections: one for
/// each group of ProgressiveMesh::group nodes, leaves or tags, and one for the rest of the section
/// up to the page's end. This rest is the base mesh's part of the faces, and all of the roots and
/// of `about`. The header has a checksum of itself and a checksum of the last section, so each byte
/// is covered. The file has 68 bytes per vertex and some pages.
void save(const ProgressiveMesh& mesh, const ProgressiveMeshExtras& extras,
          const std::filesystem::path& file);

/// Maps such a file for reading. Header, checksums, roots, base faces and `about` are checked now,
/// and everything else at its first use. So this takes almost no time, and changed bytes are
/// detected before they are used. Throws MeshError if the file cannot be opened, is not such a
/// file, or has another version or byte order; DamagedFile if it is truncated or changed.
ProgressiveMesh map_progressive_mesh(const std::filesystem::path& file);

/// Whether a file begins like the file of a progressive mesh.
bool is_progressive_mesh(const std::filesystem::path& file);

}  // namespace ensonify::refine
