#include <ensonify/engine/output/tar.h>

#include <exception>
#include <stdexcept>

#include <archive.h>
#include <archive_entry.h>
#include <fmt/format.h>

#include <ensonify/refine/atomic_file.h>

namespace ensonify::engine {

struct TarFile::Impl {
  std::filesystem::path path;
  refine::NewFile file;
  std::exception_ptr refused;  // the disk's error; an exception must not pass through C code
  bool abandoned = false;
  std::unique_ptr<archive, decltype(&archive_write_free)> tar{archive_write_new(),
                                                              archive_write_free};

  explicit Impl(const std::filesystem::path& its_path) : path(its_path), file(its_path) {
    if (!tar) throw std::bad_alloc();
    check(archive_write_set_format_ustar(tar.get()));
    check(archive_write_set_bytes_per_block(tar.get(), 10240));
    check(archive_write_open(tar.get(), this, nullptr, write, nullptr));
  }
  // Freeing the archive writes the end mark, which an unfinished file must not get.
  ~Impl() { abandoned = true; }

  static la_ssize_t write(archive*, void* self, const void* data, std::size_t size) {
    Impl& impl = *static_cast<Impl*>(self);
    try {
      if (!impl.abandoned && !impl.refused)
        impl.file.write({static_cast<const std::byte*>(data), size});
    } catch (...) {
      impl.refused = std::current_exception();
    }
    // If libarchive saw the error it would leak its memory; check() reports ours instead.
    return static_cast<la_ssize_t>(size);
  }
  void check(int result) const {
    if (refused) std::rethrow_exception(refused);
    if (result == ARCHIVE_OK) return;
    const char* reason = archive_error_string(tar.get());
    throw std::runtime_error(
        fmt::format("{}: {}", path.string(), reason ? reason : "no memory left"));
  }
};

TarFile::TarFile(const std::filesystem::path& file) : impl_(std::make_unique<Impl>(file)) {}
TarFile::~TarFile() = default;

void TarFile::add(const std::string& name, std::span<const std::byte> content) {
  const std::unique_ptr<archive_entry, decltype(&archive_entry_free)> entry(archive_entry_new(),
                                                                            archive_entry_free);
  if (!entry) throw std::bad_alloc();
  archive_entry_set_pathname(entry.get(), name.c_str());
  archive_entry_set_filetype(entry.get(), AE_IFREG);
  archive_entry_set_perm(entry.get(), 0644);
  archive_entry_set_mtime(entry.get(), 0, 0);
  archive_entry_set_size(entry.get(), static_cast<la_int64_t>(content.size()));
  archive* tar = impl_->tar.get();
  impl_->check(archive_write_header(tar, entry.get()));
  const bool whole = archive_write_data(tar, content.data(), content.size()) ==
                     static_cast<la_ssize_t>(content.size());
  impl_->check(whole ? ARCHIVE_OK : ARCHIVE_FATAL);
}

void TarFile::finish() {
  impl_->check(archive_write_close(impl_->tar.get()));
  impl_->file.commit();
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
  check(archive_read_open_filename(tar.get(), file.c_str(), 1 << 16) == ARCHIVE_OK);
  const std::uintmax_t whole = std::filesystem::file_size(file);
  archive_entry* entry = nullptr;
  int result = ARCHIVE_OK;
  while ((result = archive_read_next_header(tar.get(), &entry)) == ARCHIVE_OK) {
    const la_int64_t size = archive_entry_size(entry);
    check(size >= 0 && static_cast<std::uintmax_t>(size) <= whole);
    std::vector<std::byte> content(static_cast<std::size_t>(size));
    check(archive_read_data(tar.get(), content.data(), content.size()) == size);
    const char* const name = archive_entry_pathname(entry);
    check(name != nullptr);  // none if it is not in the locale's encoding
    f(name, std::move(content));
  }
  check(result == ARCHIVE_EOF);
}

}  // namespace ensonify::engine
