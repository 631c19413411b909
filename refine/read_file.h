#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <limits>
#include <new>
#include <span>
#include <string>
#include <string_view>
#include <utility>

namespace ensonify::refine {

/// The one door to the files that a user names, and to those in folders that are read back: a
/// regular file, open for reading. A named pipe would wait without end, and a device may have none.
class FileReader {
 public:
  /// What the user can mend does not throw: then fault() has it. `stop_check` is called for each
  /// megabyte; what it throws ends the reading.
  explicit FileReader(const std::filesystem::path& file,
                      std::uintmax_t max_bytes = std::numeric_limits<std::uintmax_t>::max(),
                      std::function<void()> stop_check = {});
  ~FileReader();
  FileReader(const FileReader&) = delete;
  FileReader& operator=(const FileReader&) = delete;

  /// Why the file is not open, and what to do; empty if it is.
  const std::string& fault() const { return fault_; }
  /// The system's reason for that, as errno; 0 if it has none.
  int error() const { return error_; }
  /// Throws as fail_to_read() if the system has a reason, and Error with the file's name for
  /// another fault.
  void require_open() const;
  std::uintmax_t bytes() const { return bytes_; }
  /// For libraries that read by descriptor; this object closes it.
  int descriptor() const { return descriptor_; }

  /// The next bytes: fewer than fit only at the file's end. Throws as fail_to_read().
  std::size_t read(std::span<std::byte> bytes);
  /// The next line, without its end; false at the file's end.
  bool next_line(std::string& line, char line_end = '\n');
  /// All that follows. Also throws std::bad_alloc, and Error for more than `max_bytes`.
  std::string rest();
  /// What is read next begins at this byte.
  void seek(std::uint64_t place);

 private:
  void open();

  const std::filesystem::path file_;
  const std::uintmax_t max_bytes_;
  const std::function<void()> stop_check_;
  std::string fault_;
  int error_ = 0, descriptor_ = -1;
  std::uintmax_t bytes_ = 0;
  std::string block_;  // that next_line() has read, and where the next byte is
  std::size_t place_in_block_ = 0;
};

/// The content of a file that this program wrote. Throws as FileReader::require_open(), and as
/// fail_to_read() if not all of it can be read.
std::string read_file(const std::filesystem::path& file,
                      std::uintmax_t max_bytes = std::numeric_limits<std::uintmax_t>::max());

/// Why a file that a user names cannot be opened, and what to do; empty if it can be.
std::string fault_of_file(const std::filesystem::path& file);

/// Throws `Fault`, with the file's name, for a file that cannot be opened.
template <class Fault>
void require_file(const std::filesystem::path& file) {
  if (const std::string fault = fault_of_file(file); !fault.empty())
    throw Fault(file.string() + ": " + fault);
}

/// The content of a file that a user names. Throws `Fault`, with the file's name, if it cannot be
/// opened, has more than `max_bytes` or does not fit into the memory; and as FileReader.
template <class Fault>
std::string read_user_file(const std::filesystem::path& file,
                           std::uintmax_t max_bytes = std::numeric_limits<std::uintmax_t>::max(),
                           std::function<void()> stop_check = {}) {
  FileReader reader(file, max_bytes, std::move(stop_check));
  if (!reader.fault().empty()) throw Fault(file.string() + ": " + reader.fault());
  try {
    return reader.rest();
  } catch (const std::bad_alloc&) {
    throw Fault(file.string() + ": is too large for the memory; split it");
  }
}

/// The first bytes of a file; fewer if it has fewer, none if the user has to mend its path or its
/// permissions. Throws as fail_to_read() if they cannot be read for another reason.
std::string begin_of_file(const std::filesystem::path& file, std::size_t bytes);
bool begins_with(const std::filesystem::path& file, std::string_view begin);

/// Whether bytes begin as a text in UTF-16 does: with its mark and a letter.
bool is_utf16(std::string_view bytes);
inline constexpr std::string_view utf16_fault = "the file is in UTF-16, expected UTF-8; save it so";

}  // namespace ensonify::refine
