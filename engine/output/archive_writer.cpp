#include <ensonify/engine/output/archive_writer.h>

#include <exception>
#include <new>
#include <stdexcept>
#include <utility>

#include <archive.h>
#include <archive_entry.h>
#include <fmt/format.h>

namespace ensonify::engine {

struct ArchiveWriter::Impl {
  std::string what;
  Write write;
  std::exception_ptr refused;  // the first exception of `write`
  bool abandoned = false;
  // The last member, because its destructor may call write_bytes(), which uses the others.
  std::unique_ptr<archive, decltype(&archive_write_free)> output{archive_write_new(),
                                                                 archive_write_free};

  Impl(ArchiveFormat format, std::string its_what, Write its_write)
      : what(std::move(its_what)), write(std::move(its_write)) {
    if (!output) throw std::bad_alloc();
    if (format == ArchiveFormat::ustar) {
      check(archive_write_set_format_ustar(output.get()));
      check(archive_write_set_bytes_per_block(output.get(), 10240));
    } else {
      check(archive_write_set_format_zip(output.get()));
      // Speckle hardly compresses: level 6 takes three times as long and saves 2 %.
      check(archive_write_set_options(output.get(),
                                      "zip:compression=deflate,zip:compression-level=1"));
      check(archive_write_set_bytes_per_block(output.get(), 0));
    }
    check(archive_write_open(output.get(), this, nullptr, write_bytes, nullptr));
  }
  // Freeing `output` would write the end mark, which an unfinished file must not have.
  ~Impl() { abandoned = true; }

  /// Keeps an exception for check(), because an exception must not pass through C code, and
  /// libarchive leaks memory if this function returns an error.
  static la_ssize_t write_bytes(archive*, void* self, const void* data, std::size_t size) {
    Impl& impl = *static_cast<Impl*>(self);
    try {
      if (!impl.abandoned && !impl.refused) impl.write({static_cast<const std::byte*>(data), size});
    } catch (...) {
      impl.refused = std::current_exception();
    }
    return static_cast<la_ssize_t>(size);
  }
  void check(int result) const {
    if (refused) std::rethrow_exception(refused);
    if (result == ARCHIVE_OK) return;
    const char* reason = archive_error_string(output.get());
    throw std::runtime_error(fmt::format("{}: {}", what, reason ? reason : "no memory left"));
  }
};

ArchiveWriter::ArchiveWriter(ArchiveFormat format, std::string what, Write write)
    : impl_(std::make_unique<Impl>(format, std::move(what), std::move(write))) {}
ArchiveWriter::~ArchiveWriter() = default;

void ArchiveWriter::add(const std::string& name, std::span<const std::byte> content) {
  const std::unique_ptr<archive_entry, decltype(&archive_entry_free)> entry(archive_entry_new(),
                                                                            archive_entry_free);
  if (!entry) throw std::bad_alloc();
  archive_entry_set_pathname(entry.get(), name.c_str());
  archive_entry_set_filetype(entry.get(), AE_IFREG);
  archive_entry_set_perm(entry.get(), 0644);
  archive_entry_set_size(entry.get(), static_cast<la_int64_t>(content.size()));
  archive* const output = impl_->output.get();
  impl_->check(archive_write_header(output, entry.get()));
  // libarchive takes at most 2 GiB at once.
  while (!content.empty()) {
    const la_ssize_t written = archive_write_data(output, content.data(), content.size());
    impl_->check(written > 0 ? ARCHIVE_OK : ARCHIVE_FATAL);
    content = content.subspan(static_cast<std::size_t>(written));
  }
}

void ArchiveWriter::finish() { impl_->check(archive_write_close(impl_->output.get())); }

}  // namespace ensonify::engine
