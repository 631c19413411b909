#include <algorithm>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "support/catch.h"
#include "support/files.h"
#include "support/program.h"
#include "support/temporary_folder.h"
#include "support/tiny_scene.h"

#include <ensonify/engine/output/png.h>

using namespace ensonify::tests;
using nlohmann::json;

namespace {

const std::string objects = R"(
[[objects]]
shape = "box"
class = "crate"
material = "wood"
east_m = 6
tall_m = 1.5
heading_deg = 30
[[objects]]
shape = "boulder"
count = 3
area = [[-12, -6], [-4, -6], [-4, 6], [-12, 6]]
)";

Outcome run(const TemporaryFolder& folder, const std::string& more,
            const std::vector<std::string>& arguments = {}) {
  write_text(folder / "scene.toml", tiny_scene + more);
  std::vector<std::string> all{"run", "scene.toml", "-o", "out"};
  all.insert(all.end(), arguments.begin(), arguments.end());
  return run_program(folder.path(), all);
}

}  // namespace

TEST_CASE("A run writes its targets' boxes and outlines, and the manifest lists that file") {
  const TemporaryFolder folder;
  REQUIRE(run(folder, objects).code == 0);
  const json targets = json::parse(read_text(folder / "out/left-right_targets.json"));
  CHECK(targets["objects"] == 4);
  CHECK(targets["picture"]["columns"] == 200);
  CHECK(targets["picture"]["rows"] == 9);
  CHECK(targets["picture"]["row_order"] == "newest_first");
  REQUIRE(!targets["targets"].empty());
  const json& crate = targets["targets"][0];
  CHECK(crate["instance"] == 1);
  CHECK(crate["class"] == "crate");
  CHECK(crate["material"] == "wood");
  CHECK(crate["side"] == "starboard");
  CHECK(crate["aspect_deg"].get<double>() == Approx(60.0));
  CHECK(crate["body"]["box"][0].get<int>() >= 100);
  CHECK(crate["body"]["polygons"][0].size() % 2 == 0);
  CHECK(crate["shadow"]["area_px"].get<int>() > 0);
  CHECK(crate["visible_fraction"].get<double>() > 0.9);
  CHECK(crate["visible_fraction"].get<double>() <= 1.0);
  const json manifest = json::parse(read_text(folder / "out/manifest.json"));
  CHECK(std::ranges::any_of(manifest["files"], [](const json& file) {
    return file["name"] == "left-right_targets.json";
  }));
  const std::string once = read_text(folder / "out/left-right_targets.json");
  REQUIRE(run(folder, objects, {"--threads", "1"}).code == 0);
  CHECK(read_text(folder / "out/left-right_targets.json") == once);
}

TEST_CASE("The truth is a picture with a legend, and features of the bed are targets") {
  const TemporaryFolder folder;
  const std::string boulders =
      "[[seafloor.boulders]]\nper_hectare = 400\ndiameter_m = 2\nheight_ratio = 0.8\n";
  REQUIRE(run(folder, objects + boulders, {"-D", "output.truth=true"}).code == 0);
  const std::string png = read_text(folder / "out/left-right_truth.png");
  REQUIRE(png.size() > 24);
  const auto number = [&](std::size_t at) {  // IHDR, big-endian
    return static_cast<unsigned char>(png[at + 2]) * 256 + static_cast<unsigned char>(png[at + 3]);
  };
  CHECK(number(16) == 200);
  CHECK(number(20) > 9);  // the legend's lines are below
  const json targets = json::parse(read_text(folder / "out/left-right_targets.json"));
  CHECK(targets["objects"] == 4);
  CHECK(targets["features"].get<int>() > 5);
  int features = 0;
  for (const json& target : targets["targets"]) {
    if (target["instance"].get<int>() <= 4) continue;
    ++features;
    CHECK(target["layer"] == "boulders.0");
    CHECK(target["class"] == "boulder");
    CHECK_FALSE(target.contains("buried"));
  }
  CHECK(features > 0);
}

TEST_CASE("The truth lies over the picture, also in ground range") {
  const std::string more = GENERATE("display.palette=grey", "display.smoothing_px=1.5",
                                    "display.track_smoothing_px=2", "display.palette=paper");
  CAPTURE(more);
  const TemporaryFolder folder;
  REQUIRE(run(folder, objects,
              {"-D", "output.truth=true", "-D", "display.slant_range_correction=true", "-D", more})
              .code == 0);
  const auto picture_of = [&](const char* name) {
    const std::string png = read_text(folder / name);
    return ensonify::engine::decode_png(std::as_bytes(std::span(png)));
  };
  const auto picture = picture_of("out/left-right.png"),
             truth = picture_of("out/left-right_truth.png");
  REQUIRE(truth.width == picture.width);
  // The bed of one sediment is not tinted.
  int grey = 0, different = 0, bright = 0;
  for (std::size_t i = 0; i < picture.pixels.size(); ++i) {
    const std::uint8_t* pixel = &truth.pixels[3 * i];
    if (pixel[0] != pixel[1] || pixel[1] != pixel[2]) continue;
    ++grey;
    different += pixel[0] != picture.pixels[i];
    bright += picture.pixels[i] > 0;
  }
  CHECK(grey > 600);
  CHECK(bright > 500);
  CHECK(different == 0);
}

TEST_CASE("An area outside the survey is reported with its line in the scene") {
  const TemporaryFolder folder;
  write_text(folder / "bed.asc",
             "ncols 4\nnrows 3\nxllcorner 0\nyllcorner 0\ncellsize 10\n"
             "-20 -20 -20 -20\n-20 -21 -21 -20\n-20 -20 -20 -20\n");
  write_text(folder / "scene.toml",
             "version = 1\n[seafloor]\nkind = \"survey\"\nsurvey = \"bed.asc\"\n"
             "[[seafloor.patches]]\nmaterial = \"rock\"\n"
             "polygon_m = [[900, 0], [910, 0], [910, 9]]\n");
  const Outcome outcome = run_program(folder.path(), {"run", "scene.toml", "-o", "out"});
  CAPTURE(outcome.err);
  CHECK(outcome.code == 2);
  CHECK(outcome.err.find("scene.toml:5:") != std::string::npos);
  CHECK(outcome.err.find("seafloor.patches.0: an area lies outside the seabed") !=
        std::string::npos);
}

TEST_CASE("Objects that cannot be placed end a run with one message, and nothing is left behind") {
  for (const auto& [more, message] : std::vector<std::pair<std::string, std::string>>{
           {"[[objects]]\nshape = \"box\"\neast_m = 500\n",
            "objects.0 (box): there is no bed below this object at 500.0 m east"},
           {"[[objects]]\nshape = \"box\"\ncount = 2000\n", "of 2000 objects found room"},
           {"[[objects]]\nshape = \"pot\"\nrod_m = 0.3\n", "cannot have a rod_m of 0.3"},
           {"[[objects]]\nshape = \"rope\"\npath = [[0, 0], [90, 0]]\n",
            "objects.0 (rope): there is no bed below"}}) {
    const TemporaryFolder folder;
    const Outcome outcome = run(folder, more);
    CAPTURE(outcome.err);
    CHECK(outcome.code == 2);
    CHECK(outcome.err.find(message) != std::string::npos);
    CHECK(outcome.out.empty());
    CHECK_FALSE(std::filesystem::exists(folder / "out"));
  }
}

TEST_CASE("In ground range, targets have the pixels of the picture") {
  const TemporaryFolder folder;
  REQUIRE(run(folder, objects,
              {"-D", "display.slant_range_correction=true", "-D", "objects.0.east_m=10", "-D",
               "objects.0.tall_m=0.3"})
              .code == 0);
  const json targets = json::parse(read_text(folder / "out/left-right_targets.json"));
  const json& crate = targets["targets"][0];
  // It begins about 9.2 m to starboard, 13.5 m from the sonar; a pixel is 0.15 m.
  CHECK(crate["body"]["box"][0].get<double>() == Approx(100.0 + 9.2 / 0.15).margin(5.0));
}

TEST_CASE("With speed correction the picture, its truth and its targets are to scale") {
  const TemporaryFolder folder;
  REQUIRE(run(folder, objects,
              {"-D", "output.truth=true", "-D", "display.speed_correction=true", "-D",
               "track.speed_mps=3", "-D", "track.ping_interval_s=0.2", "-D", "objects.0.east_m=10",
               "-D", "objects.0.tall_m=0.3"})
              .code == 0);
  const auto size_of = [&](const char* name) {
    const std::string png = read_text(folder / name);
    const auto picture = ensonify::engine::decode_png(std::as_bytes(std::span(png)));
    return std::pair(picture.width, picture.height);
  };
  const auto [width, height] = size_of("out/left-right.png");
  const json targets = json::parse(read_text(folder / "out/left-right_targets.json"));
  CHECK(width == 2 * 25);  // 15 m in columns of 0.6 m
  CHECK(targets["picture"]["columns"] == width);
  CHECK(size_of("out/left-right_truth.png").first == width);
  // In slant range the crate begins 13.5 m from the sonar.
  CHECK(targets["targets"][0]["body"]["box"][0].get<double>() ==
        Approx(25.0 + 13.5 / 0.6).margin(1.0));
}

TEST_CASE("A mesh without a face that has an area is refused with that cause") {
  const std::string flat = "v 0 0 0\nv 1 0 0\nv 2 0 0\nf 1 2 3\nf 3 2 1\n";
  const std::string cause = "flat.obj: no face is left after the repair: all 2 have no area";
  for (const std::string more : {"[[objects]]\nmesh = \"flat.obj\"\n", ""}) {
    CAPTURE(more);
    const TemporaryFolder folder;
    write_text(folder / "flat.obj", flat);
    const Outcome outcome = run(
        folder, more,
        more.empty()
            ? std::vector<std::string>{"-D", "seafloor.kind=mesh", "-D", "seafloor.mesh=flat.obj"}
            : std::vector<std::string>{});
    CAPTURE(outcome.err);
    CHECK(outcome.code == 2);
    CHECK(outcome.err.find(cause) != std::string::npos);
  }
}

TEST_CASE("A warning names an object that is wider than the seafloor") {
  const std::string roof = "v 0 0 0\nv 1000 0 0\nv 0 1000 400\nf 1 2 3\n";
  const TemporaryFolder folder;
  write_text(folder / "roof.obj", roof);
  const std::string objects = "[[objects]]\nmesh = \"roof.obj\"\n";
  const std::string warning =
      "roof.obj: is 1000 m wide, and the seafloor 40 m; is it in millimetres?";
  CHECK(run(folder, objects + "height_m = -400\n").err.find(warning) != std::string::npos);
  const Outcome scaled = run(folder, objects + "scale = 0.001\n");
  CHECK(scaled.code == 0);
  CHECK(scaled.err.find("millimetres") == std::string::npos);
}
