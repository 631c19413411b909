// Neither a command nor the library writes over a file that it reads.

#include <filesystem>
#include <string>
#include <vector>

#include <ensonify/engine/output/png.h>
#include <ensonify/engine/run.h>
#include <ensonify/engine/scene/reader.h>

#include "support/catch.h"
#include "support/files.h"
#include "support/program.h"
#include "support/tiny_scene.h"
#include "support/tree.h"

using namespace ensonify::engine;
using namespace ensonify::tests;
namespace fs = std::filesystem;
using Words = std::vector<std::string>;

namespace {

/// A run, r, of a scene; its mesh and grid; and scenes and a recipe that read such files.
struct FolderOfInputs : TemporaryFolder {
  FolderOfInputs() {
    write_text(*this / "scene.toml", tiny_scene + "[output]\nxtf = true\n");
    done({"run", "scene.toml", "-o", "r", "--quiet"});
    done({"seafloor", "scene.toml", "-o", "bed.ply", "--quiet"});
    done({"seafloor", "scene.toml", "-o", "bed.tif", "--quiet"});
    fs::copy_file(*this / "r/left-right.xtf", *this / "line.xtf");
    const auto png = encode_png({2, 1, 1, {1, 1}});
    write_text(*this / "area.png", {reinterpret_cast<const char*>(png.data()), png.size()});
    fs::create_directory(*this / "pictures");
    fs::copy_file(*this / "area.png", *this / "pictures/a.png");
    write_text(*this / "survey.toml",
               "version = 1\n[seafloor]\nkind = \"survey\"\nsurvey = \"bed.tif\"\n");
    write_text(*this / "bed.asc",
               "ncols 3\nnrows 3\nxllcorner 0\nyllcorner 0\ncellsize 10\n"
               "-20 -20 -20\n-20 -21 -20\n-20 -20 -20\n");
    write_text(*this / "bed.prj", "Projection UTM\nDatum WGS84\nZone 32\nUnits METERS\n");
    write_text(*this / "text_grid.toml",
               "version = 1\n[seafloor]\nkind = \"survey\"\nsurvey = \"bed.asc\"\n");
    const std::string area = "[[seafloor.patches]]\nimage = \"area.png\"\nmaterial = \"plain\"\n";
    write_text(*this / "area.toml", tiny_scene + area);
    write_text(*this / "recipe.toml", tiny_scene + area + "[dataset]\nsamples = 1\n");
  }
  Outcome outcome_of(const Words& words) const { return run_program(path(), words); }
  void done(const Words& words) const {
    const Outcome outcome = outcome_of(words);
    CAPTURE(words, outcome.err);
    REQUIRE(outcome.code == 0);
  }
};

}  // namespace

TEST_CASE("A command refuses to write over a file that it reads, under any of its names") {
  const FolderOfInputs folder;
  fs::create_symlink("bed.ply", folder / "link.pm");
  fs::create_hard_link(folder / "bed.tif", folder / "other.tif");
  fs::create_symlink("r/left-right.exr", folder / "image.tif");
  const auto before = tree_of(folder.path());
  const auto refused = [&](const Words& words, const std::string& output) {
    CAPTURE(words);
    const Outcome outcome = folder.outcome_of(words);
    CHECK(outcome.code == 2);
    CHECK(outcome.out.empty());
    CHECK(outcome.err.starts_with("ensonify: " + output + ": this file is read ("));
    CHECK(tree_of(folder.path()) == before);
  };
  for (const std::string output : {"scene.toml", "./r/../scene.toml"})
    refused({"analyse", "scene.toml", "-o", output}, output);
  for (const std::string output : {"bed.ply", "link.pm"})
    refused({"analyse", "bed.ply", "-o", output}, output);
  for (const std::string output : {"bed.asc", "bed.prj"})  // one belongs to the other
    refused({"analyse", "text_grid.toml", "-o", output}, output);
  for (const std::string output : {"bed.tif", "other.tif"})
    refused({"seafloor", "survey.toml", "-o", output}, output);
  refused({"view", "area.toml", "-o", "area.png"}, "area.png");
  refused({"preview", "recipe.toml", "-o", "area.png"}, "area.png");
  refused({"mosaic", "r", "-o", "image.tif"}, "image.tif");
  for (const std::string output : {"line.xtf", "r/left-right.exr", "r/manifest.json"})
    refused({"compare", "line.xtf", "r", "--html", output}, output);
  refused({"compare", "line.xtf", "pictures", "--html", "pictures/a.png"}, "pictures/a.png");
  for (const std::string track : {"r/left-right_pings.csv", "r/left-right.xtf"})
    refused({"run", "scene.toml", "-o", "r", "-D", "track.kind=file", "-D", "track.file=" + track},
            track);
}

TEST_CASE("The library refuses a run that would replace the track that it follows") {
  const FolderOfInputs folder;
  const auto before = tree_of(folder.path());
  const Words overrides{"track.kind=file", "track.file=r/left-right_pings.csv"};
  const Scene scene = read_scene(folder / "scene.toml", overrides);
  CHECK_THROWS_WITH(run(scene, folder / "r", {}),
                    Catch::Contains("left-right_pings.csv: this file is read ("));
  CHECK(tree_of(folder.path()) == before);
  CHECK_NOTHROW(run(scene, folder / "r2", {}));
}

TEST_CASE("A command writes over its own earlier output") {
  const FolderOfInputs folder;
  for (const Words& words : std::vector<Words>{
           {"analyse", "bed.ply", "-o", "bed.pm", "--quiet"},
           {"seafloor", "survey.toml", "-o", "copy.tif", "--quiet"},
           {"view", "scene.toml", "-o", "view.png", "--width-px", "64", "--quiet"},
           {"preview", "recipe.toml", "-o", "sheet.png", "--quiet"},
           {"mosaic", "r", "-o", "r/mosaic.tif", "--quiet"},
           {"compare", "r", "line.xtf", "--html", "r/page.html"},
           {"run", "scene.toml", "-o", "r", "--quiet"},
       }) {
    folder.done(words);
    const auto before = tree_of(folder.path());
    folder.done(words);
    CHECK(tree_of(folder.path()) == before);
  }
}
