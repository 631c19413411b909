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
/// The file, in the byte order of the machine: a page of 4096 bytes with the header (Header in the
/// .cpp: magic, version, byte order, counts, bounds, world origin, key, the places of the
/// sections), then one section per array, each starting at a page and padded with zeros to a page's
/// end. The last section has the XXH3-64 checksums of all others: of each section's groups of
/// ProgressiveMesh::group nodes, leaves or tags, then of its rest up to the page's end, which is
/// the base mesh's part of the faces, and all of the roots and of `about`. The header has a
/// checksum of itself and one of the checksums, so that each byte is covered. 68 bytes per vertex
/// and some pages.
void save(const ProgressiveMesh& mesh, const ProgressiveMeshExtras& extras,
          const std::filesystem::path& file);

/// Maps such a file for reading. Header, checksums, roots, base faces and `about` are checked now,
/// everything else at first use, so this takes almost no time, and changed bytes are noticed before
/// they are used. Throws MeshError if the file cannot be opened, is not such a file, or has another
/// version or byte order; DamagedFile if it is truncated or changed.
ProgressiveMesh map_progressive_mesh(const std::filesystem::path& file);

/// Whether a file begins like one with a progressive mesh.
bool is_progressive_mesh(const std::filesystem::path& file);

}  // namespace ensonify::refine
