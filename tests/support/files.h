#pragma once

#include <cstdint>
#include <filesystem>
#include <fstream>
#include <set>
#include <sstream>
#include <stdexcept>
#include <string>
#include <string_view>

namespace ensonify::tests {

/// The content of a file; empty if there is none.
inline std::string read_text(const std::filesystem::path& file) {
  std::ifstream stream(file, std::ios::binary);
  std::ostringstream text;
  text << stream.rdbuf();
  return text.str();
}

/// Writes bytes into a file unchanged.
inline void write_text(const std::filesystem::path& file, std::string_view text) {
  std::ofstream out(file, std::ios::binary);
  out << text;
  if (!out.flush()) throw std::runtime_error("test: cannot write " + file.string());
}

/// Damages one byte of a file.
inline void change_byte(const std::filesystem::path& file, std::uint64_t place) {
  std::fstream open(file, std::ios::in | std::ios::out | std::ios::binary);
  open.seekg(static_cast<std::streamoff>(place));
  const int byte = open.get();
  open.seekp(static_cast<std::streamoff>(place));
  open.put(static_cast<char>(byte ^ 0x10));
}

/// The names of the files and folders in a folder.
inline std::set<std::string> names_in(const std::filesystem::path& folder) {
  std::set<std::string> names;
  for (const auto& entry : std::filesystem::directory_iterator(folder))
    names.insert(entry.path().filename().string());
  return names;
}

}  // namespace ensonify::tests
