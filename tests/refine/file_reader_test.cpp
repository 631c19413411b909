#include <ensonify/refine/read_file.h>

#include <array>
#include <filesystem>
#include <span>
#include <stdexcept>
#include <string>
#include <vector>

#include <sys/stat.h>

#include <ensonify/refine/error.h>
#include <ensonify/refine/mesh_reader.h>
#include <ensonify/refine/triangle_mesh.h>

#include "support/catch.h"
#include "support/files.h"
#include "support/temporary_folder.h"

using namespace ensonify::refine;
using ensonify::tests::TemporaryFolder;
using ensonify::tests::write_text;
namespace fs = std::filesystem;

TEST_CASE("only regular files of a limited size are opened, and none is waited for") {
  const TemporaryFolder folder;
  write_text(folder / "ten", "0123456789");
  CHECK(read_file(folder / "ten", 10) == "0123456789");
  REQUIRE(mkfifo((folder / "pipe").c_str(), 0600) == 0);
  fs::create_symlink("pipe", folder / "link");
  fs::create_symlink("/dev/zero", folder / "zero");
  for (const std::string name : {"pipe", "link", "zero"}) {
    const std::string fault =
        (folder / name).string() + ": is not a regular file; correct the path";
    CHECK_THROWS_WITH(read_file(folder / name), fault);
    CHECK_THROWS_WITH(read_user_file<MeshError>(folder / name), fault);
    CHECK(begin_of_file(folder / name, 4).empty());
  }
  CHECK_THROWS_WITH(read_file(folder.path()), Catch::Contains("is a folder"));
  CHECK_THROWS_WITH(read_file(folder / "ten", 9),
                    Catch::Contains("has 10 bytes, expected at most 9"));
  CHECK_THROWS_AS(read_file(folder / "ten", 9), ensonify::Error);
  // A file of the system has no size.
  CHECK(read_file("/proc/self/status").size() > 100);
  CHECK_THROWS_WITH(read_file("/proc/self/status", 100),
                    Catch::Contains("has more than 100 bytes"));
}

TEST_CASE("a file is read by lines, by bytes and from a place on") {
  const TemporaryFolder folder;
  std::string text;
  std::vector<std::string> lines;
  for (int i = 0; i < 30'000; ++i) {
    lines.push_back(std::to_string(i * 7919 % 1000));
    text += lines.back() + "\n";
  }
  lines.emplace_back("last");
  write_text(folder / "file", text + "last");
  FileReader reader(folder / "file");
  std::string line;
  for (const std::string& wanted : lines) {
    REQUIRE(reader.next_line(line));
    REQUIRE(line == wanted);
  }
  CHECK(!reader.next_line(line));
  reader.seek(2);
  CHECK((reader.next_line(line) && line == lines[1]));
  std::array<char, 4> four{};
  CHECK(reader.read(std::as_writable_bytes(std::span(four))) == 4);
  const std::size_t place = 2 + lines[1].size() + 1;
  CHECK(std::string(four.data(), 4) == text.substr(place, 4));
  CHECK(reader.rest() == (text + "last").substr(place + 4));
  CHECK(reader.read(std::as_writable_bytes(std::span(four))) == 0);
}

TEST_CASE("a long file can be stopped while it is read") {
  const TemporaryFolder folder;
  write_text(folder / "a.stl", "");
  fs::resize_file(folder / "a.stl", 64 << 20);
  int checks = 0;
  const auto stop = [&] {
    if (++checks == 3) throw std::domain_error("stopped");
  };
  CHECK_THROWS_AS(read_mesh(folder / "a.stl", stop), std::domain_error);
  CHECK(checks == 3);
}

TEST_CASE("a pointer of Git LFS or git-annex is named as what it is") {
  const TemporaryFolder folder;
  write_text(folder / "a.ply",
             "version https://git-lfs.github.com/spec/v1\n"
             "oid sha256:4d7a214614ab2935c943f9e0ff69d22eadbb8f32b1258daaa5e2ca24d17e2393\n"
             "size 12345\n");
  CHECK_THROWS_WITH(read_mesh(folder / "a.ply"),
                    Catch::Contains("a.ply: is a pointer of Git LFS, not the file itself; fetch it "
                                    "with `git lfs pull`"));
  write_text(folder / "a.ply", "/annex/objects/SHA256E-s12345--4d7a21.ply\n");
  CHECK_THROWS_WITH(read_mesh(folder / "a.ply"), Catch::Contains("`git annex get`"));
}
