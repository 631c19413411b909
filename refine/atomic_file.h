#pragma once

#include <cstddef>
#include <filesystem>
#include <memory>
#include <span>
#include <string_view>

namespace ensonify::refine {

/// Puts bytes into a file so that at any moment the file is the old one or the whole new one:
/// a temporary beside it, fsync, rename, fsync of the folder. Nothing is left behind on failure; a
/// killed process leaves its temporary, .NAME.NUMBER.tmp, which nobody reads and no other writer
/// takes. Throws std::system_error naming the file and the step that failed.
void write_file(const std::filesystem::path& file, std::span<const std::byte> bytes);
void write_file(const std::filesystem::path& file, std::string_view text);
/// The same of bytes that lie in several places, one behind another.
void write_file(const std::filesystem::path& file,
                std::span<const std::span<const std::byte>> parts);

/// The same piece by piece, for what memory does not hold: nothing is in place before commit(), and
/// nothing is left behind without it.
class NewFile {
 public:
  explicit NewFile(const std::filesystem::path& file);
  ~NewFile();
  NewFile(const NewFile&) = delete;
  NewFile& operator=(const NewFile&) = delete;
  void write(std::span<const std::byte> bytes);
  void commit();

 private:
  struct Open;
  std::filesystem::path file_;
  std::unique_ptr<Open> open_;
};

/// Writes a file into a folder of one's own, for put_in_place() to bring to the disk with all
/// others. Throws std::system_error as write_file does, and then leaves what there is for its
/// folder's owner to remove.
void write_staged(const std::filesystem::path& file, std::span<const std::byte> bytes);

/// Puts a folder in place of nothing: brings its file system to the disk (syncfs, which is much
/// faster than an fsync for each of many files), renames, fsync of the folder above. False where
/// something is there already. Throws std::system_error as write_file does.
bool put_in_place(const std::filesystem::path& folder, const std::filesystem::path& place);

/// Makes a folder to write into, and those above it, as far as they are missing. False where it is
/// there already. Throws std::system_error as write_file does, also where nothing may be written
/// into it.
bool make_folder(const std::filesystem::path& folder);

}  // namespace ensonify::refine
