#pragma once

#include <cstddef>
#include <functional>
#include <memory>
#include <span>
#include <string>

namespace ensonify::engine {

enum class ArchiveFormat { ustar, zip };

/// Writes files into an archive, without times or owners. Not thread-safe.
class ArchiveWriter {
 public:
  using Write = std::function<void(std::span<const std::byte>)>;
  /// `write` receives the archive's bytes in order; messages of errors begin with `what`. Functions
  /// throw what `write` throws, std::bad_alloc, and std::runtime_error if libarchive fails.
  ArchiveWriter(ArchiveFormat format, std::string what, Write write);
  /// Writes nothing: an archive without finish() has no end mark.
  ~ArchiveWriter();
  ArchiveWriter(const ArchiveWriter&) = delete;
  ArchiveWriter& operator=(const ArchiveWriter&) = delete;

  void add(const std::string& name, std::span<const std::byte> content);
  void finish();

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace ensonify::engine
