#pragma once

#include <cstddef>
#include <filesystem>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include <ensonify/engine/output/archive_writer.h>
#include <ensonify/refine/atomic_file.h>

namespace ensonify::engine {

/// Writes a tar file (ustar) without times or owners. The file gets its final name in finish().
class TarFile {
 public:
  explicit TarFile(const std::filesystem::path& file);
  /// Throws std::system_error if the file cannot be written, std::runtime_error for a name that
  /// does not fit into a tar header.
  void add(const std::string& name, std::span<const std::byte> content) {
    archive_.add(name, content);
  }
  void finish();

 private:
  refine::NewFile file_;
  ArchiveWriter archive_;
};

/// Whether the file exists and ends with the zeros that end a tar. A tar that was cut short does
/// not end with them. Throws std::system_error if the file cannot be read.
bool is_whole_tar(const std::filesystem::path& file);

/// Calls f for each member, in order. Throws std::runtime_error with the name of a damaged file.
void read_tar(
    const std::filesystem::path& file,
    const std::function<void(const std::string& name, std::vector<std::byte> content)>& f);

}  // namespace ensonify::engine
