#pragma once

#include <cstdint>
#include <filesystem>
#include <limits>
#include <string>
#include <string_view>

namespace ensonify::refine {

/// The content of a file that this program wrote. Throws as fail_to_read() if not all of it can be
/// read.
std::string read_file(const std::filesystem::path& file);

/// Why a file that a user names cannot be opened, and what to do; empty if it can be.
std::string fault_of_file(const std::filesystem::path& file);

/// The content of a file that a user names; empty with a `fault` if it cannot be read or has more
/// than `max_bytes`.
std::string try_read_file(const std::filesystem::path& file, std::uintmax_t max_bytes,
                          std::string& fault);

/// Throws `Fault`, with the file's name, for a file that cannot be opened.
template <class Fault>
void require_file(const std::filesystem::path& file) {
  if (const std::string fault = fault_of_file(file); !fault.empty())
    throw Fault(file.string() + ": " + fault);
}

/// The content of a file that a user names. Throws `Fault`, with the file's name, if it cannot be
/// read or has more than `max_bytes`.
template <class Fault>
std::string read_user_file(const std::filesystem::path& file,
                           std::uintmax_t max_bytes = std::numeric_limits<std::uintmax_t>::max()) {
  std::string fault;
  std::string content = try_read_file(file, max_bytes, fault);
  if (!fault.empty()) throw Fault(file.string() + ": " + fault);
  return content;
}

/// The first bytes of a file; fewer if it has fewer, none if it has a fault_of_file(). Throws as
/// fail_to_read() if they cannot be read in spite of that.
std::string begin_of_file(const std::filesystem::path& file, std::size_t bytes);
bool begins_with(const std::filesystem::path& file, std::string_view begin);

}  // namespace ensonify::refine
