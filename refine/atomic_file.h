#pragma once

#include <cstddef>
#include <filesystem>
#include <span>
#include <string_view>

namespace ensonify::refine {

/// Puts bytes into a file so that at any moment the file is the old one or the whole new one:
/// a temporary beside it, fsync, rename, fsync of the folder. Nothing is left behind on failure; a killed
/// process leaves its temporary, .NAME.NUMBER.tmp, which nobody reads and no other writer takes.
/// Throws std::system_error naming the file and the step that failed.
void write_file(const std::filesystem::path& file, std::span<const std::byte> bytes);
void write_file(const std::filesystem::path& file, std::string_view text);
/// The same of bytes that lie in several places, one behind another.
void write_file(const std::filesystem::path& file,
                std::span<const std::span<const std::byte>> parts);

}  // namespace ensonify::refine
