// Files of a folder that is read back, for example the folder of a run or of a dataset: other
// programs may have put anything there.

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include <sys/stat.h>

#include <ensonify/engine/base/csv_table.h>
#include <ensonify/engine/comparison/picture_source.h>
#include <ensonify/engine/dataset/dataset_json.h>
#include <ensonify/engine/dataset/merge.h>
#include <ensonify/engine/mosaic/image_reader.h>
#include <ensonify/engine/mosaic/recorded_run.h>
#include <ensonify/engine/output/manifest.h>
#include <ensonify/engine/output/tar.h>
#include <ensonify/engine/recording/recording_reader.h>
#include <ensonify/engine/run/output_folder.h>
#include <ensonify/engine/run/part_record.h>
#include <ensonify/engine/run/run_plan.h>
#include <ensonify/engine/scene/reader.h>
#include <ensonify/engine/scene/scene_paths.h>
#include <ensonify/engine/seafloor/bed/survey.h>
#include <ensonify/refine/mesh_reader.h>
#include <ensonify/refine/progressive_mesh_file.h>

#include "support/catch.h"
#include "support/files.h"
#include "support/message.h"
#include "support/small_dataset.h"
#include "support/temporary_folder.h"

using namespace ensonify;
using namespace ensonify::engine;
using namespace ensonify::tests;
namespace fs = std::filesystem;

namespace {

std::string message_of(const std::function<void()>& read) {
  return message_thrown<std::exception>(read, "was read");
}

}  // namespace

TEST_CASE(
    "a file that is read back is a regular file of a limited size, or is refused by its name") {
  const TemporaryFolder folder;
  struct Reading {
    std::string name;
    std::function<void(const fs::path&)> read;
    bool is_limited = true;
  };
  const std::vector<Reading> readings{
      {"run.json", [&](const fs::path&) { read_plan(folder.path()); }},
      {"part.json", [](const fs::path& file) { read_part_json(file); }},
      {"manifest.json", [&](const fs::path&) { read_recorded_run(folder.path(), "", {}); }},
      {"dataset.json", [](const fs::path& file) { require_same_dataset(file, ""); }},
      {"dataset.json", [&](const fs::path&) { merge(folder.path()); }},
      {"sample.json", [&](const fs::path&) { is_whole_sample(folder.path(), 0, ""); }},
      {"scene.toml", [](const fs::path& file) { read_scene(file); }},
      {"line.exr", [](const fs::path& file) { ImageReader{file}; }, false},
      {"000.tar", [](const fs::path& file) { read_tar(file, [](const auto&, auto) {}); }, false},
  };
  for (const Reading& its : readings) {
    CAPTURE(its.name);
    const fs::path file = folder / its.name;
    REQUIRE(mkfifo(file.c_str(), 0600) == 0);
    // A folder whose manifest is no file is not the folder of a run.
    const bool by_file = its.name != "manifest.json";
    const std::string why = message_of([&] { its.read(file); });
    CHECK_THAT(why, Catch::Contains(by_file ? its.name : folder.path().string()));
    if (by_file) CHECK_THAT(why, Catch::Contains("is not a regular file"));
    fs::remove(file);
    fs::create_symlink("/dev/zero", file);
    CHECK_THAT(message_of([&] { its.read(file); }),
               Catch::Contains(by_file ? "is not a regular file" : "there is no manifest.json"));
    fs::remove(file);
    write_text(file, "");
    fs::resize_file(file, 300'000'000);
    if (its.is_limited)
      CHECK_THAT(message_of([&] { its.read(file); }),
                 Catch::Contains(its.name + ": has 300000000 bytes, expected at most "));
    fs::remove(file);
  }
  REQUIRE(mkfifo((folder / "000.tar").c_str(), 0600) == 0);
  CHECK_THROWS_WITH(is_whole_tar(folder / "000.tar"), Catch::Contains("is not a regular file"));
  CHECK_THROWS_WITH(xxh128_of_file(folder / "000.tar"), Catch::Contains("is not a regular file"));
  write_text(folder / "manifest.json", "");
  fs::resize_file(folder / "manifest.json", 300'000'000);
  CHECK_THAT(message_of([&] { files_of_run(folder.path()); }),
             Catch::Contains("manifest.json: has 300000000 bytes"));
}

TEST_CASE("a pointer of Git LFS is named as what it is by each reader of a user's file") {
  const TemporaryFolder folder;
  const std::string pointer =
      "version https://git-lfs.github.com/spec/v1\noid sha256:4d7a2146\nsize 12345\n";
  for (const std::string name : {"a.ply", "a.tif", "a.xtf", "a.csv", "a.toml", "a.exr", "a.pm"})
    write_text(folder / name, pointer);
  fs::create_directory(folder / "pictures");
  write_text(folder / "pictures/a.png", pointer);
  const std::vector<std::function<void()>> readings{
      [&] { refine::read_mesh(folder / "a.ply"); },
      [&] { refine::map_progressive_mesh(folder / "a.pm"); },
      [&] { read_survey(folder / "a.tif", 0.0); },
      [&] {
        read_survey({folder / "a.csv", 1.0}, 0.0);
      },
      [&] { read_recording(folder / "a.xtf"); },
      [&] { CsvTable::read(folder / "a.csv", {.row = "row", .columns = {}}); },
      [&] { read_scene(folder / "a.toml"); },
      [&] { resolve("key", "a.tif", {.scene_folder = folder.path()}); },
      [&] { ImageReader{folder / "a.exr"}; },
      [&] { line_of_pictures(folder / "pictures"); },
  };
  for (const auto& read : readings) CHECK_THAT(message_of(read), Catch::Contains("`git lfs pull`"));
}

TEST_CASE("a link that leads out of a dataset does not get into what is merged") {
  const TemporaryFolder folder, outside;
  SmallDataset().write(folder / "set");
  REQUIRE(merge(folder / "set").damaged.empty());
  write_text(outside / "secret", "SECRET");
  const fs::path place = folder / "set/samples/000000";
  fs::create_symlink(outside / "secret", place / "notes.txt");
  const std::vector<std::string> damaged = merge(folder / "set").damaged;
  REQUIRE(damaged.size() == 1);
  CHECK_THAT(damaged.front(), Catch::Contains("notes.txt is a link that leads out of the dataset"));
  // A link to a file of the dataset is as good as the file.
  fs::remove(place / "notes.txt");
  fs::rename(place / "line.png", folder / "set/picture");
  fs::create_symlink("../../picture", place / "line.png");
  CHECK(merge(folder / "set").damaged.empty());
}
