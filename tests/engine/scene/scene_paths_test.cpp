// Tests in which folders the files of a scene may lie.

#include <ensonify/engine/scene/dump.h>
#include <ensonify/engine/scene/keys/key_text.h>
#include <ensonify/engine/scene/reader.h>

#include <sys/stat.h>

#include <filesystem>

#include "support/catch.h"
#include "support/files.h"
#include "support/parsed_scene.h"
#include "support/temporary_folder.h"

using namespace ensonify::engine;
using ensonify::tests::contents;
using ensonify::tests::error_of;
using ensonify::tests::head;
using ensonify::tests::TemporaryFolder;
using ensonify::tests::write_text;
namespace fs = std::filesystem;

TEST_CASE("A scene's files lie under its folder or the data folder, and nowhere else") {
  TemporaryFolder folder;
  const fs::path scenes = folder / "scenes", data = folder / "data";
  fs::create_directories(scenes / "sub");
  fs::create_directories(data);
  for (const fs::path& file :
       {scenes / "a.tif", scenes / "sub/b.tif", data / "c.tif", folder / "out.tif"})
    write_text(file, "grid");
  fs::create_symlink(folder / "out.tif", scenes / "leads_out.tif");
  fs::create_symlink(folder.path(), scenes / "up");
  fs::create_symlink("sub/b.tif", scenes / "stays.tif");
  fs::create_symlink("/dev/zero", scenes / "zero");
  fs::create_symlink("loop", scenes / "loop");
  REQUIRE(mkfifo((scenes / "fifo").c_str(), 0600) == 0);
  const auto read = [&](const std::string& survey, const fs::path& data_folder) {
    write_text(scenes / "s.toml",
               head + "[seafloor]\nkind = \"survey\"\nsurvey = " + toml_string(survey) + "\n");
    return read_scene(scenes / "s.toml", {}, data_folder);
  };

  for (const auto& [name, file] :
       std::vector<std::pair<std::string, fs::path>>{{"a.tif", scenes / "a.tif"},
                                                     {"./sub/b.tif", scenes / "sub/b.tif"},
                                                     {"stays.tif", scenes / "sub/b.tif"},
                                                     {"data:c.tif", data / "c.tif"}}) {
    const Scene scene = read(name, data);
    CHECK(scene.seafloor.survey.name == name);
    CHECK(scene.seafloor.survey.path == fs::canonical(file));
    const std::string dumped = dump_scene(scene);
    CHECK(dumped.find(folder.path().string()) == std::string::npos);
    const Scene back = parse_scene(dumped, "dumped", {}, {scenes, data});
    CHECK(back.seafloor.survey.path == scene.seafloor.survey.path);
    CHECK(contents(back) == contents(scene));
  }

  const std::string start = (scenes / "s.toml").string() + ":4:10: 'seafloor.survey' names ";
  for (const auto& [name, why] : std::vector<std::pair<std::string, std::string>>{
           {"../out.tif",
            "expected a path under the scene's own folder, without '..', or data:path"},
           {"sub/../a.tif", "without '..'"},
           {"sub/..", "without '..'"},
           {"data:../out.tif", "without '..'"},
           {"data:/etc/passwd", "expected a path under"},
           {(scenes / "a.tif").string(), "expected a path under"},
           {"/dev/zero", "expected a path under"},
           {"/vsizip/a.zip", "expected a path under"},
           {"leads_out.tif", "a link leads out of"},
           {"up/out.tif", "a link leads out of"},
           {"up/data/c.tif", "a link leads out of"},
           {"zero", "a link leads out of"},
           {"fifo", "is not a regular file"},
           {"sub", "is a folder"},
           {".", "is a folder"},
           {"data:", "is a folder"},
           {"data:a.tif", "No such file"},
           {"missing.tif", "No such file"},
           {"a.tif/x", "Not a directory"},
           {"loop", "symbolic links"},
           {"vrt://a.tif", "No such file"},
           {std::string("a.tif\0x", 7), "NUL"},
           {std::string(5000, 'x'), "too long"},
           {"file:///etc/passwd", "No such file"},
           {"~/a.tif", "No such file"}}) {
    INFO(name);
    const std::string error = error_of([&, &its_name = name] { read(its_name, data); });
    CHECK(error.starts_with(start));
    CHECK(error.find(why) != std::string::npos);
  }
  CHECK(error_of([&] { read("data:c.tif", {}); }) ==
        start + "\"data:c.tif\": no data folder is known: give --data DIR or set ENSONIFY_DATA");

  // Back to a fractal bed from the command line.
  read("a.tif", {});
  const std::vector<std::string> away = {"seafloor.kind=fractal", "seafloor.survey="};
  CHECK(read_scene(scenes / "s.toml", away).seafloor.survey.name.empty());
}
