// Datasets of imaging sonars: clips of frames.

#include <cmath>
#include <map>
#include <set>
#include <string>
#include <utility>

#include <nlohmann/json.hpp>

#include "support/catch.h"
#include "support/files.h"
#include "support/generate.h"
#include "support/tiny_recipe.h"

using namespace ensonify::tests;
using Json = nlohmann::json;

namespace {

const std::string clips = R"(version = 1
seed = 3
conditions = "ideal"
[dataset]
samples = 4
renders = 2
[dataset.split]
train = 1
val = 1
[seafloor]
extent_east_m = 40
extent_north_m = 40
cell_m = 0.25
depth_m = 10
material = "fine sand"
[[objects]]
shape = "box"
class = "crate"
length_m = 1
width_m = 1
tall_m = 1
east_m = { uniform = [-2, 2] }
north_m = 8
[[objects]]
shape = "cylinder"
class = "mine"
east_m = 3
north_m = 6
[track]
pings = 3
speed_mps = 1
ping_interval_s = 0.5
altitude_m = 2
[sonar.ahead]
kind = "imaging"
range_m = 15
bins = 150
beams = 64
field_of_view_deg = 90
array_length_m = 0.06
elevations = 200
[display]
gain_db = { uniform = [-3, 3] }
[output]
exr = false
)";

}  // namespace

TEST_CASE("a clip has labels of each frame, and a target keeps its number in all of them") {
  const TemporaryFolder folder;
  write_text(folder / "recipe.toml", clips);
  generate_whole(folder.path(), "set");
  const Outcome merged = run_program(folder.path(), {"merge", "set", "--quiet"});
  INFO(merged.err);
  REQUIRE(merged.code == 0);
  for (const auto& [group, width, height] :
       {std::tuple{"beams_frame", 150, 64}, {"fan_frame", 2 * 107, 150}}) {
    CAPTURE(group);
    std::size_t images = 0, clips_seen = 0;
    for (const char* split : {"train", "val"}) {
      const Json coco = Json::parse(
          read_text(folder / "set/coco" / (std::string(group) + "_" + split + ".json")));
      images += coco.at("images").size();
      clips_seen += coco.at("videos").size();
      std::map<int, Json> of;  // images by number
      std::map<int, std::set<int>> frames;
      for (const Json& image : coco.at("images")) {
        CHECK((image.at("width") == width && image.at("height") == height));
        of[image.at("id")] = image;
        CHECK(frames[image.at("video_id")].insert(image.at("frame_id").get<int>()).second);
      }
      for (const auto& [video, numbers] : frames) CHECK(numbers == std::set{0, 1, 2});
      // By track: its video, its instance, its class.
      std::map<int, std::tuple<int, int, int>> tracks;
      std::map<int, int> lengths;
      for (const Json& annotation : coco.at("annotations")) {
        const Json& image = of.at(annotation.at("image_id"));
        const Json& box = annotation.at("bbox");
        CHECK(annotation.at("video_id") == image.at("video_id"));
        CHECK(box.at(0).get<int>() + box.at(2).get<int>() <= width);
        CHECK(box.at(1).get<int>() + box.at(3).get<int>() <= height);
        const std::tuple<int, int, int> is{annotation.at("video_id"), annotation.at("instance"),
                                           annotation.at("category_id")};
        CHECK(tracks.emplace(annotation.at("instance_id"), is).first->second == is);
        ++lengths[annotation.at("instance_id")];
      }
      for (const auto& [track, frames_shown] : lengths) CHECK(frames_shown == 3);
      CHECK(lengths.size() == 2 * coco.at("videos").size());  // both targets in each clip
    }
    CHECK(images == 2 * 4 * 3);  // displays, samples, pings
    CHECK(clips_seen == 2 * 4);
  }
  CHECK(read_text(folder / "set/README.md").find("Simulated imaging sonar: 4") !=
        std::string::npos);
}

TEST_CASE("the labels of a frame lie where the target is, in beams and in the fan") {
  const TemporaryFolder folder;
  write_text(folder / "recipe.toml", clips);
  generate_whole(folder.path(), "set");
  for (const int sample : {0, 1, 2, 3})
    for (const int ping : {0, 1, 2}) {
      const std::string name = "set/samples/00000" + std::to_string(sample) +
                               "/frames/ahead_00000" + std::to_string(ping);
      const Json beams = Json::parse(read_text(folder / (name + ".json"))),
                 fan = Json::parse(read_text(folder / (name + "_fan.json")));
      CHECK(beams.at("kind") == "frame");
      CHECK(beams.at("frame") == ping);
      CHECK(beams.at("targets").size() == 2);
      const Json& from = beams.at("seen_from");
      for (std::size_t t = 0; t < 2; ++t) {
        const Json &label = beams.at("targets").at(t), &drawn = fan.at("targets").at(t);
        CAPTURE(sample, ping, t);
        CHECK(label.at("instance") == drawn.at("instance"));
        const double east_m = label.at("middle_m")[0].get<double>() -
                              from.at("position_m")[0].get<double>(),
                     north_m = label.at("middle_m")[1].get<double>() -
                               from.at("position_m")[1].get<double>(),
                     up_m = label.at("middle_m")[2].get<double>() -
                            from.at("position_m")[2].get<double>();
        const double bearing_rad = std::atan2(east_m, north_m);
        // A body lies within its size of its middle.
        CHECK(label.at("range_m").get<double>() ==
              Approx(std::hypot(east_m, north_m, up_m)).margin(0.7));
        CHECK(label.at("bearing_deg").get<double>() == Approx(bearing_rad * 57.29578).margin(5.0));
        CHECK(label.at("aspect_deg").is_number());
        const Json& box = drawn.at("body").at("box");
        const double px_m = fan.at("pixel_across_m");
        const double middle_m = (box[0].get<double>() + 0.5 * box[2].get<double>()) * px_m +
                                fan.at("seen_from").at("across_m")[0].get<double>();
        const double ahead_m =
            (fan.at("height").get<double>() - box[1].get<double>() - 0.5 * box[3].get<double>()) *
            px_m;
        const double slant_m = std::hypot(east_m, north_m, up_m);
        CHECK(middle_m == Approx(slant_m * std::sin(bearing_rad)).margin(0.9));
        CHECK(ahead_m == Approx(slant_m * std::cos(bearing_rad)).margin(0.9));
      }
    }
}

TEST_CASE("pieces of a line are refused where all sonars make frames") {
  const TemporaryFolder folder;
  for (const std::string asked : {"dataset.tiles.width_px=64", "dataset.chips.size_px=32",
                                  "dataset.ground_px_m=0.1", "dataset.slant=false"}) {
    write_text(folder / "recipe.toml", clips);
    std::vector<std::string> more{"-D", asked};
    if (asked.find("width") != asked.npos)
      more.insert(more.end(), {"-D", "dataset.tiles.height_px=64"});
    const Outcome refused = generate(folder.path(), "none", more);
    CAPTURE(asked);
    CHECK(refused.code == 2);
    CHECK(refused.err.find("cannot be used with imaging sonars") != std::string::npos);
  }
}
