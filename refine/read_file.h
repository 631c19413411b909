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

/// A regular file, open for reading. All files that a user names, and all files in folders that are
/// read back, are opened by this class. Others are refused: a named pipe would wait without end,
/// and a device may have no end.
class FileReader {
 public:
  /// Does not throw for a fault that the user can correct: fault() returns it. `stop_check` is
  /// called for each megabyte that is read; its exceptions end the reading.
  explicit FileReader(const std::filesystem::path& file,
                      std::uintmax_t max_bytes = std::numeric_limits<std::uintmax_t>::max(),
                      std::function<void()> stop_check = {});
  ~FileReader();
  FileReader(const FileReader&) = delete;
  FileReader& operator=(const FileReader&) = delete;

  /// Why the file is not open, and what to do; empty if it is open.
  const std::string& fault() const { return fault_; }
  /// The system's error (errno) that is the reason for the fault; 0 if there is none.
  int error() const { return error_; }
  /// Throws std::system_error if error() is not 0, and Error with the file's name for other faults.
  void require_open() const;
  std::uintmax_t bytes() const { return bytes_; }
  /// For libraries that read by descriptor. This object closes the descriptor.
  int descriptor() const { return descriptor_; }

  /// Reads the next bytes and returns their number: fewer than `bytes` has only at the file's end.
  /// Throws std::system_error if they cannot be read.
  std::size_t read(std::span<std::byte> bytes);
  /// Reads the next line, without its line end; false at the file's end.
  bool next_line(std::string& line, char line_end = '\n');
  /// Returns all further bytes. Also throws std::bad_alloc, and Error for more than `max_bytes`.
  std::string rest();
  /// Moves to this byte; the next reading begins there.
  void seek(std::uint64_t place);

 private:
  void open();

  const std::filesystem::path file_;
  const std::uintmax_t max_bytes_;
  const std::function<void()> stop_check_;
  std::string fault_;
  int error_ = 0, descriptor_ = -1;
  std::uintmax_t bytes_ = 0;
  std::string block_;  // what next_line() has read, and the place of its next byte
  std::size_t place_in_block_ = 0;
};

/// The content of a file that this program wrote. Throws as FileReader::require_open(), and
/// std::system_error if not all of it can be read.
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
/// opened, has more than `max_bytes` or does not fit into memory. Also throws as FileReader.
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

/// The first bytes of a file: fewer if the file is shorter, none if the user has to correct its
/// path or its permissions. Throws std::system_error if the file cannot be read for another reason.
std::string begin_of_file(const std::filesystem::path& file, std::size_t bytes);
bool begins_with(const std::filesystem::path& file, std::string_view begin);

/// Whether bytes begin like a text in UTF-16: with a byte-order mark and a letter.
bool is_utf16(std::string_view bytes);
inline constexpr std::string_view utf16_fault = "the file is in UTF-16, expected UTF-8; save it so";

}  // namespace ensonify::refine
