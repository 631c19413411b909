#pragma once

#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <string_view>

#include <ensonify/refine/atomic_file.h>

namespace ensonify::engine {

/// A file in a run's folder. The hash is XXH3 with 128 bits, as `xxhsum -H2` prints it.
struct FileRecord {
  std::string name;
  std::uint64_t size_bytes = 0;
  std::string xxh128;
};

/// The hash of bytes, 32 hexadecimal digits.
std::string xxh128(std::span<const std::byte> bytes);
std::string xxh128(std::string_view text);
/// The hash of a file's content. Throws std::system_error, with the file's name, if the file cannot
/// be opened or read to its end.
std::string xxh128_of_file(const std::filesystem::path& file);
/// The record of a file in a folder, with size and hash of the same bytes. Throws as
/// xxh128_of_file().
FileRecord record_of(const std::filesystem::path& folder, const std::string& name);
/// The record of a file that `read_at` reads. refine::write_file() and write_staged() pass a
/// `read_at` that reads back the written file, so the record describes the bytes that this process
/// wrote, even if other processes change the folder. Throws what `read_at` throws.
FileRecord record_of(const std::string& name, const refine::ReadAt& read_at);

/// Versions of the libraries that can affect the bytes of a result, as JSON.
std::string library_versions();
/// This program's version, as "1.2.3".
std::string_view program_version();

/// Whether a file can be the rest of a run's manifest.json (manifest_json() in part_record.h) after
/// a crash: the file is empty, or it begins as a manifest does. Throws
/// std::filesystem::filesystem_error if there is no such file.
bool begins_as_manifest(const std::filesystem::path& file);

}  // namespace ensonify::engine
