#pragma once

#include <filesystem>

namespace ensonify::refine {

/// Throws std::system_error for a file that cannot be opened or read to its end. The message has
/// the file's name and what to do. `error` is the value of errno; 0 if it is not known.
[[noreturn]] void fail_to_read(const std::filesystem::path& file, int error);

}  // namespace ensonify::refine
