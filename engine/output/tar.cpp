#include <ensonify/engine/output/tar.h>

#include <algorithm>
#include <array>
#include <iterator>
#include <memory>
#include <new>
#include <stdexcept>
#include <utility>

#include <archive.h>
#include <archive_entry.h>
#include <fmt/format.h>

#include <ensonify/refine/read_file.h>

namespace ensonify::engine {

TarFile::TarFile(const std::filesystem::path& file)
    : file_(file),
      archive_(ArchiveFormat::ustar, file.string(),
               [this](std::span<const std::byte> bytes) { file_.write(bytes); }) {}

void TarFile::finish() {
  archive_.finish();
  file_.commit();
}

bool is_whole_tar(const std::filesystem::path& file) {
  if (!std::filesystem::exists(file)) return false;
  std::array<std::byte, 1024> end{};  // a tar ends with two blocks of zeros
  refine::FileReader in(file);
  in.require_open();
  if (in.bytes() < end.size()) return false;
  in.seek(in.bytes() - end.size());
  return in.read(end) == end.size() &&
         std::ranges::all_of(end, [](std::byte byte) { return byte == std::byte{0}; });
}

void read_tar(const std::filesystem::path& file,
              const std::function<void(const std::string&, std::vector<std::byte>)>& f) {
  const std::unique_ptr<archive, decltype(&archive_read_free)> tar(archive_read_new(),
                                                                   archive_read_free);
  if (!tar) throw std::bad_alloc();
  const auto check = [&](bool good) {
    if (good) return;
    const char* reason = archive_error_string(tar.get());
    throw std::runtime_error(
        fmt::format("{}: {}", file.string(), reason ? reason : "cannot be read"));
  };
  check(archive_read_support_format_tar(tar.get()) == ARCHIVE_OK);
  const refine::FileReader reader(file);
  reader.require_open();
  check(archive_read_open_fd(tar.get(), reader.descriptor(), 1 << 16) == ARCHIVE_OK);
  const std::uintmax_t whole = reader.bytes();
  archive_entry* entry = nullptr;
  int result = ARCHIVE_OK;
  while ((result = archive_read_next_header(tar.get(), &entry)) == ARCHIVE_OK) {
    const la_int64_t size = archive_entry_size(entry);
    check(size >= 0 && static_cast<std::uintmax_t>(size) <= whole);
    std::vector<std::byte> content(static_cast<std::size_t>(size));
    check(archive_read_data(tar.get(), content.data(), content.size()) == size);
    const char* const name = archive_entry_pathname(entry);
    check(name != nullptr);  // null if the name is not in the locale's encoding
    f(name, std::move(content));
  }
  check(result == ARCHIVE_EOF);
}

}  // namespace ensonify::engine
