#include <ensonify/refine/read_file.h>

#include <filesystem>
#include <functional>
#include <system_error>

#include "support/catch.h"
#include "support/files.h"
#include "support/temporary_folder.h"

using namespace ensonify::refine;
using ensonify::tests::TemporaryFolder;

namespace {

std::error_code error_of(const std::function<void()>& reading) {
  try {
    reading();
  } catch (const std::system_error& error) {
    return error.code();
  }
  return {};
}

}  // namespace

TEST_CASE("a file is read whole, also an empty one and one of several blocks") {
  const TemporaryFolder folder;
  std::string text;
  for (int i = 0; i < 100'000; ++i) text += std::to_string(i);
  for (const std::string& content : {std::string(), std::string("short"), text}) {
    ensonify::tests::write_text(folder / "file", content);
    CHECK(read_file(folder / "file") == content);
    CHECK(begin_of_file(folder / "file", 3) == content.substr(0, 3));
  }
}

TEST_CASE("a file that cannot be opened or read to its end is an error, not an empty one") {
  // The first page of a process is never mapped, and reading it is an error of input.
  const std::filesystem::path unreadable = "/proc/self/mem";
  CHECK(error_of([&] { read_file(unreadable); }) == std::errc::io_error);
  CHECK(error_of([&] { begin_of_file(unreadable, 8); }) == std::errc::io_error);
  const TemporaryFolder folder;
  std::filesystem::create_symlink("loop", folder / "loop");
  CHECK(error_of([&] { read_file(folder / "loop"); }) == std::errc::too_many_symbolic_link_levels);
  CHECK(error_of([&] { read_file(folder / "missing"); }) == std::errc::no_such_file_or_directory);
}
