#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <span>
#include <string_view>
#include <vector>

namespace ensonify::refine {

/// Writes bytes at a place of a file. The place may be before bytes that are already written.
using WriteAt = std::function<void(std::uint64_t place, std::span<const std::byte> bytes)>;
/// Writes a file's content piece by piece, so that the whole content need not be in memory.
using WriteContent = std::function<void(const WriteAt& write_at)>;
/// Writes bytes that are in memory.
WriteContent content_of(std::span<const std::byte> bytes);

/// Fills `bytes` from a place of a file. Returns their number: fewer than fit only at the file's
/// end.
using ReadAt = std::function<std::size_t(std::uint64_t place, std::span<std::byte> bytes)>;
/// Reads a file that is written, but does not have its final name yet.
using ReadBack = std::function<void(const ReadAt& read_at)>;

/// Writes bytes into a file so that at any moment the file is the old one or the complete new one.
/// The steps are: write a temporary file in the same folder, fsync, rename, fsync of the folder. A
/// failure leaves nothing behind. A killed process leaves its temporary file, .NAME.NUMBER.tmp,
/// which the next writer of the file removes (if the file system has locks). Throws
/// std::system_error with the file and the step.
void write_file(const std::filesystem::path& file, std::span<const std::byte> bytes);
void write_file(const std::filesystem::path& file, std::string_view text);
/// Writes several parts, one after another.
void write_file(const std::filesystem::path& file,
                std::span<const std::span<const std::byte>> parts);

/// Does what write_file does, for a writer who keeps the file open. The file appears at commit().
/// Without commit() nothing is left behind.
class NewFile {
 public:
  explicit NewFile(const std::filesystem::path& file);
  ~NewFile();
  NewFile(const NewFile&) = delete;
  NewFile& operator=(const NewFile&) = delete;
  /// Appends bytes to those that write() has written.
  void write(std::span<const std::byte> bytes);
  void commit();
  /// The empty temporary file, for a library that writes to a file by its name and does not replace
  /// it.
  std::filesystem::path temporary() const;

 private:
  struct Open;
  std::filesystem::path file_;
  std::unique_ptr<Open> open_;
  std::uint64_t end_ = 0;  // bytes that write() has written
};

/// Removes a temporary file of write_file() or NewFile if its writer was killed. If it is still
/// being written it stays. If the file system has no locks, it always stays.
void remove_abandoned(const std::filesystem::path& temporary);

/// Writes a file into a private folder, which put_in_place() later syncs as a whole. Throws as
/// write_file does, and then leaves the partial file in the folder.
void write_staged(const std::filesystem::path& file, std::span<const std::byte> bytes);
/// Does this piece by piece. `read_back` reads the file when it is complete. Also throws what
/// write_content and read_back throw.
void write_staged(const std::filesystem::path& file, const WriteContent& write_content,
                  const ReadBack& read_back = {});

/// Writes the files of a folder to the disk: syncs their file system (syncfs, much faster than an
/// fsync for each of many files). Throws std::system_error.
void sync_files(const std::filesystem::path& folder);
/// Moves files, in the order of `names`, to another folder of the same file system, and syncs that
/// folder. Replaces files with these names. Throws std::system_error at the first file that it
/// cannot move.
void move_files(const std::filesystem::path& from, const std::filesystem::path& to,
                std::span<const std::string> names);

/// Moves a folder to a place where nothing is yet: sync_files(), rename, fsync of the parent
/// folder. Returns false if something is there. Throws std::system_error as write_file does.
bool put_in_place(const std::filesystem::path& folder, const std::filesystem::path& place);

/// Makes a folder to write into, and its missing parents. Returns the folders that it made, the
/// innermost first. Throws std::system_error as write_file does, also if the folder is not
/// writable, and then removes the folders that it made.
std::vector<std::filesystem::path> make_folder(const std::filesystem::path& folder);

/// Removes the folders that are empty, in the given order, such as those that make_folder()
/// returned.
void remove_empty(std::span<const std::filesystem::path> folders);

}  // namespace ensonify::refine
