#include <ensonify/engine/output/manifest.h>

#include <filesystem>
#include <fstream>
#include <string>
#include <system_error>
#include <vector>

#include <sys/resource.h>

#include "support/catch.h"
#include "support/temporary_folder.h"

using namespace ensonify::engine;

namespace {

std::error_code error_of_hashing(const std::filesystem::path& file) {
  try {
    xxh128_of_file(file);
  } catch (const std::system_error& error) {
    return error.code();
  }
  return {};
}

}  // namespace

TEST_CASE("The hash is XXH3 with 128 bits, big-endian") {
  // Published: XXH3_128bits of nothing with seed 0.
  CHECK(xxh128("") == "99aa06d3014798d86001c324468d497f");
  CHECK(xxh128(std::span<const std::byte>()) == "99aa06d3014798d86001c324468d497f");
  const std::string text(1000, 'x');
  CHECK(xxh128(text) == xxh128(std::as_bytes(std::span(text))));
  CHECK(xxh128(text) != xxh128(text.substr(1)));
}

TEST_CASE("The hash of a file is that of its content, or fails if the file cannot be read") {
  const ensonify::tests::TemporaryFolder folder;
  const std::filesystem::path file = folder / "f";
  std::ofstream(file) << "content";
  CHECK(xxh128_of_file(file) == xxh128("content"));
  CHECK(error_of_hashing(folder / "missing") == std::errc::no_such_file_or_directory);
  std::filesystem::create_symlink("loop", folder / "loop");
  CHECK(error_of_hashing(folder / "loop") == std::errc::too_many_symbolic_link_levels);
  const FileRecord record = record_of(folder.path(), file.filename().string());
  CHECK(record.name == file.filename().string());
  CHECK(record.size_bytes == 7);
  CHECK(record.xxh128 == xxh128("content"));
  CHECK_THROWS_AS(record_of(folder.path(), "missing"), std::system_error);

  const std::vector<std::byte> long_content(2'500'000, std::byte{7});  // several blocks
  FileRecord read_back;
  ensonify::refine::write_staged(
      folder / "long", ensonify::refine::content_of(long_content),
      [&](const ensonify::refine::ReadAt& read_at) { read_back = record_of("long", read_at); });
  CHECK(read_back.name == "long");
  CHECK(read_back.size_bytes == long_content.size());
  CHECK(read_back.xxh128 == xxh128(long_content));

  // The first page of a process is never mapped, and reading it is an error of input. This comes
  // before descriptors lack: the first time that an error's virtual table is checked, UBSan needs
  // one.
  CHECK(error_of_hashing("/proc/self/mem") == std::errc::io_error);

  rlimit before{};
  REQUIRE(getrlimit(RLIMIT_NOFILE, &before) == 0);
  const rlimit none{0, before.rlim_max};
  REQUIRE(setrlimit(RLIMIT_NOFILE, &none) == 0);
  const std::error_code error = error_of_hashing(file);
  REQUIRE(setrlimit(RLIMIT_NOFILE, &before) == 0);
  CHECK(error == std::errc::too_many_files_open);
}
