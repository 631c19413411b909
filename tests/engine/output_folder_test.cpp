#include <ensonify/engine/run/output_folder.h>

#include <filesystem>
#include <set>
#include <string>

#include <fmt/format.h>

#include <ensonify/engine/output/manifest.h>
#include <ensonify/engine/run/part_record.h>
#include <ensonify/engine/scene/scene.h>

#include "support/catch.h"
#include "support/files.h"
#include "support/program.h"
#include "support/temporary_folder.h"

using namespace ensonify::engine;
using ensonify::tests::names_in;
using ensonify::tests::read_text;
using ensonify::tests::TemporaryFolder;
using ensonify::tests::write_text;
namespace fs = std::filesystem;

namespace {

/// Writes these files and a manifest that lists them.
void write_run(OutputFolder& output, const std::set<std::string>& names,
               const std::string& content) {
  std::string list;
  for (const std::string& name : names) {
    output.write(name, std::as_bytes(std::span(content)));
    list += fmt::format(R"({}{{"name": "{}", "size_bytes": {}}})", list.empty() ? "" : ", ", name,
                        content.size());
  }
  const std::string manifest = fmt::format(R"({{"program": "ensonify", "files": [{}]}})", list);
  output.write("manifest.json", std::as_bytes(std::span(manifest)));
}

void make_run(const fs::path& folder, const std::set<std::string>& names,
              const std::string& content) {
  OutputFolder output(folder, false);
  output.begin();
  write_run(output, names, content);
  output.keep();
}

}  // namespace

TEST_CASE("a run replaces an earlier one as a whole, and leaves other files alone") {
  const TemporaryFolder folder;
  const fs::path place = folder / "run";
  make_run(place, {"a.png", "a.exr"}, "first");
  write_text(place / "mine.txt", "stays");
  make_run(place, {"a.png", "a.npz"}, "second");
  CHECK(names_in(place) == std::set<std::string>{"a.npz", "a.png", "manifest.json", "mine.txt"});
  CHECK(read_text(place / "a.png") == "second");
}

TEST_CASE("a run removes the temporaries of pictures that a killed run showed, and no others") {
  const TemporaryFolder folder;
  write_text(folder / ".a.png.0.tmp", "half a picture");
  write_text(folder / ".mine.png.0.tmp", "stays");
  make_run(folder.path(), {"a.png"}, "whole");
  CHECK(names_in(folder.path()) ==
        std::set<std::string>{".mine.png.0.tmp", "a.png", "manifest.json"});
}

TEST_CASE("a run does not overwrite what no earlier run has made") {
  const TemporaryFolder folder;
  const std::vector<std::string> names{"a.png", "a.exr"};
  const auto begin = [&] {
    OutputFolder output(folder.path(), false);
    output.begin();
    output.require_own(names);
  };
  write_text(folder / "a.exr", "mine");
  CHECK_THROWS_WITH(begin(), Catch::Contains("a.exr: is not of an earlier run"));
  CHECK(names_in(folder.path()) == std::set<std::string>{"a.exr"});
  fs::remove(folder / "a.exr");
  make_run(folder.path(), {"a.png"}, "first");
  write_text(folder / "a.png", "edited");
  begin();
  write_text(folder / "a.exr", "mine");
  CHECK_THROWS_WITH(begin(), Catch::Contains("a.exr: is not of an earlier run"));
  CHECK(read_text(folder / "a.exr") == "mine");
  // A killed run leaves its temporary folder, and may have shown a picture.
  fs::remove(folder / "manifest.json");
  fs::create_directory(folder / ".manifest.json.0.tmp");
  begin();
}

TEST_CASE("a run that is not kept leaves nothing, and an earlier one as it was") {
  const TemporaryFolder folder;
  const fs::path place = folder / "run";
  const auto show = [&](const char* content) {
    OutputFolder output(place, false);
    output.begin();
    output.show("a.png", std::as_bytes(std::span(content, 5)));
    write_run(output, {"a.exr"}, "other");
  };
  show("shown");
  CHECK(!fs::exists(place));
  make_run(place, {"a.png", "a.exr"}, "first");
  show("shown");
  CHECK(names_in(place) == std::set<std::string>{"a.exr", "a.png", "manifest.json"});
  CHECK(read_text(place / "a.png") == "first");

  // Nor does one whose files cannot be put in place.
  fs::create_directories(place / "a.npz/x");
  CHECK_THROWS_WITH(make_run(place, {"a.exr", "a.npz"}, "second"),
                    Catch::Contains("a.npz: cannot write a file in place of a folder"));
  CHECK(read_text(place / "a.exr") == "first");
  CHECK(names_in(place) == std::set<std::string>{"a.exr", "a.npz", "a.png", "manifest.json"});
}

TEST_CASE("a run that was killed while it replaced an earlier one gives it back") {
  const TemporaryFolder folder;
  const fs::path place = folder / "run", staging = place / ".manifest.json.0.tmp";
  make_run(place, {"a.png", "a.exr"}, "first");
  // All earlier files are aside, and a.npz and a.png of the new run are in place.
  fs::create_directories(staging / "earlier");
  for (const char* name : {"manifest.json", "a.png", "a.exr"})
    fs::rename(place / name, staging / "earlier" / name);
  write_text(place / "a.png", "second");
  write_text(place / "a.npz", "second");
  write_text(staging / "a.exr", "second");
  write_text(staging / "manifest.json",
             R"({"program": "ensonify", "files": [{"name": "a.png"}, {"name": "a.npz"},)"
             R"( {"name": "a.exr"}]})");
  {
    OutputFolder output(place, false);
    output.begin();
  }
  CHECK(names_in(place) == std::set<std::string>{"a.exr", "a.png", "manifest.json"});
  CHECK(read_text(place / "a.png") == "first");
}

TEST_CASE("a manifest that a crash has cut short is replaced, and other text stays") {
  const TemporaryFolder folder;
  const auto refused = [&](const std::string& text) {
    write_text(folder / "manifest.json", text);
    write_text(folder / "a.png", "mine");
    try {
      make_run(folder.path(), {"a.png"}, "new");
    } catch (const SceneError& error) {
      CHECK_THAT(error.what(), Catch::Contains("manifest.json: is not the manifest of a run"));
      return read_text(folder / "manifest.json") == text && read_text(folder / "a.png") == "mine";
    }
    CHECK(read_text(folder / "a.png") == "new");
    return false;
  };
  const std::string own = manifest_json({.parts = equal_parts(1, 1)}, {});
  for (std::size_t bytes = 0; bytes < own.size(); bytes += bytes < 40 ? 1 : 100) {
    CAPTURE(bytes);
    CHECK_FALSE(refused(own.substr(0, bytes)));
  }
  for (const char* text :
       {"[1, 2]", "3", "null", "\"ensonify\"", "a list of ships", " ", "{\"program\": 3",
        "{\"name\": \"ensonify\",", "{\n  \"program\": \"ensonify 2\",", "\xef\xbb\xbf{}"}) {
    CAPTURE(text);
    CHECK(refused(text));
  }
}

TEST_CASE("a folder with a manifest of something else, or with a run in progress, is refused") {
  const TemporaryFolder folder;
  write_text(folder / "manifest.json", R"({"files": [{"name": "mine.txt", "size_bytes": 5}]})");
  write_text(folder / "mine.txt", "stays");
  CHECK_THROWS_WITH(make_run(folder.path(), {"a.png"}, "new"),
                    Catch::Contains("manifest.json: is not the manifest of a run"));
  fs::remove(folder / "manifest.json");
  fs::create_directory(folder / "manifest.json");
  CHECK_THROWS_AS(make_run(folder.path(), {"a.png"}, "new"), SceneError);
  fs::remove(folder / "manifest.json");
  OutputFolder one(folder.path(), false);
  one.begin();
  OutputFolder other(folder.path(), false);
  CHECK_THROWS_WITH(other.begin(), Catch::Contains("another process makes a run in this folder"));
  CHECK(read_text(folder / "mine.txt") == "stays");
}
