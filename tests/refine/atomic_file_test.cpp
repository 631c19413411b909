#include <ensonify/refine/atomic_file.h>
#include <ensonify/refine/temporary_name.h>

#include <atomic>
#include <csignal>
#include <fstream>
#include <set>
#include <span>
#include <stdexcept>
#include <string>
#include <system_error>
#include <thread>
#include <vector>

#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include "support/catch.h"
#include "support/files.h"
#include "support/temporary_folder.h"

namespace fs = std::filesystem;
using ensonify::refine::write_file;
using ensonify::tests::names_in;
using ensonify::tests::read_text;
using ensonify::tests::TemporaryFolder;

namespace {

/// Writes where that must fail, and checks the error.
void check_refused(const fs::path& file, std::errc reason) {
  INFO(file.string());
  try {
    write_file(file, "new");
    FAIL("was written");
  } catch (const std::system_error& error) {
    INFO(error.what());
    CHECK(error.code() == reason);
    CHECK(std::string(error.what()).find(file.string() + ": cannot ") == 0);
  }
}

}  // namespace

TEST_CASE("A file holds the bytes written, and a second write replaces them") {
  const TemporaryFolder folder;
  const std::string bytes("a\0b\n\xff", 5);
  write_file(folder / "f", bytes);
  CHECK(read_text(folder / "f") == bytes);
  write_file(folder / "f", std::string(3'000'000, 'x'));
  CHECK(read_text(folder / "f") == std::string(3'000'000, 'x'));
  write_file(folder / "f", "");
  CHECK(read_text(folder / "f").empty());
  CHECK(names_in(folder.path()) == std::set<std::string>{"f"});
}

TEST_CASE("A file can be written piece by piece, also before what is written already") {
  const TemporaryFolder folder;
  const auto in_pieces = [](const ensonify::refine::WriteAt& write_at) {
    write_at(0, std::as_bytes(std::span("....abc", 7)));
    write_at(7, std::as_bytes(std::span("def", 3)));
    write_at(1, std::as_bytes(std::span("23", 2)));
  };
  ensonify::refine::write_staged(folder / "f", in_pieces);
  CHECK(read_text(folder / "f") == ".23.abcdef");
  CHECK_THROWS_AS(ensonify::refine::write_staged(folder / "g",
                                                 [&](const ensonify::refine::WriteAt& write_at) {
                                                   in_pieces(write_at);
                                                   throw std::runtime_error("it cannot be made");
                                                 }),
                  std::runtime_error);
}

TEST_CASE("A file can be read back, under any umask") {
  const TemporaryFolder folder;
  const auto text = ensonify::refine::content_of(std::as_bytes(std::span("abcdef", 6)));
  std::string read;
  const auto read_back = [&](const ensonify::refine::ReadAt& read_at) {
    read.assign(10, '.');
    read.resize(read_at(2, std::as_writable_bytes(std::span(read))));
  };
  const mode_t before = ::umask(0777);  // the file's owner may not open it again
  ensonify::refine::write_staged(folder / "staged", text, read_back);
  ::umask(before);
  CHECK(read == "cdef");

  CHECK_THROWS_AS(ensonify::refine::write_staged(folder / "g", text,
                                                 [](const ensonify::refine::ReadAt&) {
                                                   throw std::runtime_error("it cannot be hashed");
                                                 }),
                  std::runtime_error);
}

TEST_CASE("A file's mode is 0666 minus the umask") {
  const TemporaryFolder folder;
  const mode_t before = umask(0);
  for (const mode_t mask : {0, 022, 027, 077}) {
    umask(mask);
    const fs::path file = folder / std::to_string(mask);
    write_file(file, "x");
    struct stat status {};
    CHECK(stat(file.c_str(), &status) == 0);
    CHECK((status.st_mode & 0777u) == (0666u & ~mask));
  }
  umask(before);
}

TEST_CASE("A failed write names file and reason, and leaves nothing behind") {
  const TemporaryFolder folder;
  write_file(folder / "plain", "old");
  fs::create_directory(folder / "folder");
  fs::create_symlink("/dev/null", folder / "device");
  REQUIRE(mkfifo((folder / "pipe").c_str(), 0600) == 0);
  const auto before = names_in(folder.path());

  check_refused(folder / "missing" / "f", std::errc::no_such_file_or_directory);
  check_refused(folder / "plain" / "f", std::errc::not_a_directory);
  check_refused(folder / "folder", std::errc::is_a_directory);
  check_refused(folder / "device", std::errc::invalid_argument);
  check_refused(folder / "pipe", std::errc::invalid_argument);
  check_refused(folder / std::string(300, 'n'), std::errc::filename_too_long);
  CHECK(names_in(folder.path()) == before);
  CHECK(read_text(folder / "plain") == "old");
}

TEST_CASE("A write beyond the file-size limit leaves the old file and no temporary") {
  const TemporaryFolder folder;
  const fs::path file = folder / "f";
  write_file(file, "old");
  const pid_t child = fork();
  REQUIRE(child >= 0);
  if (child == 0) {
    std::signal(SIGXFSZ, SIG_IGN);
    const rlimit limit{8192, 8192};
    setrlimit(RLIMIT_FSIZE, &limit);
    int result = 1;
    try {
      write_file(file, std::string(100'000, 'x'));
    } catch (const std::system_error& error) {
      const std::string what = error.what();
      result = error.code() == std::errc::file_too_large &&
                       what.find(file.string() + ": cannot write it") == 0
                   ? 0
                   : 2;
    }
    _exit(result);
  }
  int status = -1;
  REQUIRE(waitpid(child, &status, 0) == child);
  CHECK(WIFEXITED(status));
  CHECK(WEXITSTATUS(status) == 0);
  CHECK(read_text(file) == "old");
  CHECK(names_in(folder.path()) == std::set<std::string>{"f"});
}

TEST_CASE("A killed process's temporary is removed by the file's next writer") {
  const TemporaryFolder folder;
  for (const char* name : {".f.0.tmp", ".f.1.tmp", ".g.0.tmp"})
    std::ofstream(folder / name) << "half";
  write_file(folder / "f", "whole");
  CHECK(read_text(folder / "f") == "whole");
  CHECK(names_in(folder.path()) == std::set<std::string>{"f", ".g.0.tmp"});
}

TEST_CASE("A temporary is that of one name") {
  using ensonify::refine::is_temporary_of;
  CHECK(ensonify::refine::temporary_name("a/out", 12) == ".out.12.tmp");
  CHECK(is_temporary_of("a/out", "a/.out.0.tmp"));
  CHECK(is_temporary_of("out", ".out.12.tmp"));
  for (const char* other : {".out.tif.0.tmp", ".out..tmp", ".out.tmp", ".out.1x.tmp", "out.0.tmp",
                            ".out.0.tmp.aux.xml", ".ou.0.tmp"})
    CHECK_FALSE(is_temporary_of("out", other));
}

TEST_CASE("A temporary that is being written stays, and its writer is not disturbed") {
  const TemporaryFolder folder;
  const auto bytes = std::as_bytes(std::span("half", 4));
  ensonify::refine::NewFile slow(folder / "f");
  slow.write(bytes);
  write_file(folder / "f", "whole");
  CHECK(read_text(folder / "f") == "whole");
  CHECK(names_in(folder.path()) == std::set<std::string>{"f", ".f.0.tmp"});
  slow.write(bytes);
  slow.commit();
  CHECK(read_text(folder / "f") == "halfhalf");
  CHECK(names_in(folder.path()) == std::set<std::string>{"f"});
}

TEST_CASE("A writer whose temporary was removed says so") {
  const TemporaryFolder folder;
  ensonify::refine::NewFile slow(folder / "f");
  ensonify::refine::remove_abandoned(slow.temporary());
  CHECK(std::filesystem::remove(slow.temporary()));
  CHECK_THROWS_WITH(slow.commit(), Catch::Contains("f: another program has removed .f.0.tmp"));
}

TEST_CASE("While several write a file, a reader sees one writer's complete file") {
  const TemporaryFolder folder;
  const fs::path file = folder / "f";
  write_file(file, std::string(20'000, 'a'));
  std::atomic<int> writers = 3;
  std::vector<std::jthread> threads;
  for (const char letter : {'b', 'c', 'd'})
    threads.emplace_back([&, letter] {
      for (int i = 0; i < 40; ++i) write_file(file, std::string(20'000, letter));
      --writers;
    });
  int torn = 0, reads = 0;
  for (; writers > 0; ++reads) {
    const std::string bytes = read_text(file);
    if (bytes.size() != 20'000 || bytes.find_first_not_of(bytes.front()) != std::string::npos)
      ++torn;
  }
  CHECK(reads > 0);
  CHECK(torn == 0);
  threads.clear();
  CHECK(names_in(folder.path()) == std::set<std::string>{"f"});
}

TEST_CASE("A folder is made with its parents, which can be removed again if nothing is in them") {
  const TemporaryFolder folder;
  using ensonify::refine::make_folder, ensonify::refine::remove_empty;
  const std::vector<fs::path> made = make_folder(folder / "a/b/c");
  CHECK(made == std::vector<fs::path>{folder / "a/b/c", folder / "a/b", folder / "a"});
  CHECK(make_folder(folder / "a/b/c").empty());
  write_file(folder / "a/f", "x");
  remove_empty(made);
  CHECK(names_in(folder.path()) == std::set<std::string>{"a"});
  CHECK(names_in(folder / "a") == std::set<std::string>{"f"});
  // One that cannot be made leaves no parents.
  CHECK_THROWS_AS(make_folder(folder / "d/e" / std::string(300, 'n')), std::system_error);
  CHECK_THROWS_AS(make_folder(folder / "a/f/g"), std::system_error);
  CHECK_THROWS_AS(make_folder(folder / "a/f"), std::system_error);
  CHECK(names_in(folder.path()) == std::set<std::string>{"a"});
  fs::create_directory_symlink(folder / "gone", folder / "link");
  CHECK_THROWS_WITH(make_folder(folder / "link/x"),
                    Catch::Contains((folder / "link").string() + ", which is a link to a folder"));
  fs::remove(folder / "link");
  remove_empty(make_folder(folder / "d/e/"));
  CHECK(names_in(folder.path()) == std::set<std::string>{"a"});
}
