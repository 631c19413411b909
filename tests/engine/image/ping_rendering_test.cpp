#include <ensonify/engine/image/ping_rendering.h>

#include <array>
#include <memory>
#include <stdexcept>
#include <vector>

#include <Eigen/Geometry>

#include "support/beds.h"
#include "support/catch.h"

#include <ensonify/engine/seafloor/make_seafloor.h>
#include <ensonify/engine/sonar/echo/ray_layout.h>
#include <ensonify/engine/trace/face_sources/exact_faces.h>

using namespace ensonify;
using namespace ensonify::engine;

namespace {

/// A gently rough bed of 1 m cells, 10 m deep, with two boxes: one under the starboard fan, one
/// ahead of it.
Seafloor bed_with_boxes() {
  SeafloorOptions options{
      .extent_east_m = 60.0, .extent_north_m = 50.0, .cell_m = 1.0, .depth_m = 10.0};
  options.fractal.height_at_1m_m = 0.05;
  Seafloor bed = make_seafloor(options, 3);
  tests::add_box(bed, {9.0f, -1.5f, -11.0f}, {12.0f, 1.5f, -8.0f});
  tests::add_box(bed, {9.0f, 14.0f, -11.0f}, {12.0f, 17.0f, -8.0f});
  return bed;
}

/// A sonar with a wide beam that moves north, 6 m above the bed.
struct Stage {
  Seafloor bed = bed_with_boxes();
  std::shared_ptr<const refine::ProgressiveMesh> progressive = make_progressive_mesh(bed.mesh);
  refine::ActiveMesh mesh{*progressive};
  std::vector<Pose> track;
  std::vector<RayFan> fans;

  Stage() {
    for (double north_m = -10.0; north_m <= 10.0; ++north_m)
      track.push_back({.position = {0.0, north_m, -4.0}});
    Sonar sonar;
    sonar.array_length_m = 0.03;
    sonar.elevations = 400;
    const RayLayout layout = make_ray_layout(sonar, 0.00375, 4.0);
    std::vector<refine::FanVolume> volumes;
    for (const Sector& sector : sidescan_sectors) {
      fans.push_back(place_fan(layout, track[10], sector, 25.0));
      volumes.push_back(fan_volume_of(fans.back()));
    }
    mesh.refine(volumes);
  }
  ViewSubject subject(std::size_t ping = 10) const { return {bed, mesh, fans, track, ping}; }
};

const Stage& stage() {
  static const Stage made;
  return made;
}

/// Red, green and blue at the pixel that shows a point.
std::array<double, 3> colour_at(const PingRendering& view, const Eigen::Vector3d& point) {
  const Eigen::Vector2d pixel = view.camera.project(point).value();
  REQUIRE((pixel.x() >= 0.0 && pixel.x() < static_cast<double>(view.picture.width)));
  REQUIRE((pixel.y() >= 0.0 && pixel.y() < static_cast<double>(view.picture.height)));
  const std::size_t at = 3 * (static_cast<std::size_t>(pixel.y()) * view.picture.width +
                              static_cast<std::size_t>(pixel.x()));
  return {double(view.picture.pixels[at]), double(view.picture.pixels[at + 1]),
          double(view.picture.pixels[at + 2])};
}
bool in_picture(const PingRendering& view, const Eigen::Vector3d& point) {
  const auto pixel = view.camera.project(point);
  return pixel && pixel->minCoeff() >= 0.0 &&
         pixel->x() < static_cast<double>(view.picture.width) &&
         pixel->y() < static_cast<double>(view.picture.height);
}

const PingRendering& large_view() {
  static const PingRendering view =
      shade(stage().subject(), {.width_px = 640, .height_px = 360, .threads = 2});
  return view;
}

/// An active face, of the bed or of an object, whose middle is in the picture.
struct ShownFace {
  Eigen::Vector3d middle;
  bool exact;
};
std::vector<ShownFace> shown_faces(bool of_objects) {
  const refine::ActiveMesh& mesh = stage().mesh;
  std::vector<ShownFace> out;
  for (const refine::ActiveMesh::ActiveFace& face : mesh.faces()) {
    if (face.slot == refine::ActiveMesh::none) continue;
    if ((face.source >= stage().bed.bed_faces) != of_objects) continue;
    ShownFace shown{Eigen::Vector3d::Zero(), true};
    for (const std::uint32_t vertex : face.vertices) {
      shown.middle += mesh.position(vertex).cast<double>() / 3.0;
      shown.exact &= mesh.nodes()[vertex].is_leaf();
    }
    if (in_picture(large_view(), shown.middle)) out.push_back(shown);
  }
  return out;
}

}  // namespace

TEST_CASE("A view has the requested size and does not depend on the number of threads") {
  const PingRendering one = shade(stage().subject(), {.width_px = 97, .height_px = 61});
  CHECK(one.picture.width == 97);
  CHECK(one.picture.height == 61);
  CHECK(one.picture.channels == 3);
  CHECK(one.picture.pixels.size() == 97 * 61 * 3);
  for (const int threads : {2, 5})
    CHECK(shade(stage().subject(), {.width_px = 97, .height_px = 61, .threads = threads})
              .picture.pixels == one.picture.pixels);
}

TEST_CASE("A camera's pixels and directions agree") {
  const Camera& camera = large_view().camera;
  for (const Eigen::Vector2d& pixel : {Eigen::Vector2d(0.0, 0.0), Eigen::Vector2d(500.0, 77.0)}) {
    const Eigen::Vector3d direction = camera.direction(pixel);
    CHECK(direction.dot(camera.forward) == Approx(1.0));
    const auto back = camera.project(camera.eye + 17.0 * direction);
    REQUIRE(back);
    CHECK((*back - pixel).norm() < 1e-9);
    CHECK_FALSE(camera.project(camera.eye - direction));
  }
  CHECK(camera.right.cross(camera.forward).dot(camera.up) == Approx(1.0));
  CHECK(camera.up.z() > 0.0);
}

TEST_CASE("A view shows the sonar in yellow, and all ends of the fans") {
  const PingRendering& view = large_view();
  const Eigen::Vector3d sonar = stage().track[10].position;
  const auto is_yellow = [&](const Eigen::Vector3d& point) {
    const auto [r, g, b] = colour_at(view, point);
    return r > 140.0 && g > 0.8 * r && b < 0.5 * r;
  };
  CHECK(is_yellow(sonar));
  CHECK(is_yellow(sonar + Eigen::Vector3d(0.0, 0.8, 0.0)));  // it is drawn 2.5 m long
  CHECK_FALSE(is_yellow(sonar + Eigen::Vector3d(0.0, 0.0, 1.0)));
  CHECK_FALSE(is_yellow(sonar - Eigen::Vector3d(0.0, 0.0, 1.0)));
  for (const RayFan& fan : stage().fans)
    for (const std::size_t e : {std::size_t{0}, fan.elevations() - 1}) {
      const Eigen::Vector3d direction = fan.direction(fan.middle, e);
      const double out_m =
          direction.z() < 0.0 ? std::min(fan.range_m, -5.0 / direction.z()) : fan.range_m;
      CHECK(in_picture(view, fan.origin + out_m * direction));
    }
}

TEST_CASE("In a view exact faces have a warm colour, coarse faces a cold one") {
  std::array<int, 2> seen{}, warm{};  // coarse faces, exact faces
  for (const ShownFace& face : shown_faces(false)) {
    const auto [r, g, b] = colour_at(large_view(), face.middle);
    ++seen[face.exact];
    warm[face.exact] += r > b;
  }
  REQUIRE(seen[0] > 50);
  REQUIRE(seen[1] > 100);
  // Not all: lines, boxes and the sonar hide some, and small faces share a pixel.
  CHECK(warm[0] < 0.1 * seen[0]);
  CHECK(warm[1] > 0.9 * seen[1]);
}

TEST_CASE("In a view an object under the fan is red, one outside it green") {
  std::array<int, 2> red{}, green{};
  for (const ShownFace& face : shown_faces(true)) {
    const auto [r, g, b] = colour_at(large_view(), face.middle);
    red[face.exact] += r > 1.3 * g && r > 1.3 * b;
    green[face.exact] += g > 1.1 * r && g > 1.1 * b;
  }
  // Their far sides are hidden, by themselves or by the bed.
  CHECK(red[1] > 2);
  CHECK(red[0] == 0);
  CHECK(green[1] == 0);
  CHECK(green[0] > 0);
}

TEST_CASE("A view needs pixels, fans and a ping, and stops when its progress throws") {
  const ViewOptions small{.width_px = 32, .height_px = 18};
  CHECK_THROWS_AS(shade(stage().subject(), {.width_px = 0}), std::invalid_argument);
  CHECK_THROWS_AS(shade(stage().subject(), {.height_px = 0}), std::invalid_argument);
  CHECK_THROWS_AS(shade(stage().subject(21), small), std::invalid_argument);
  ViewSubject blind = stage().subject();
  blind.fans = {};
  CHECK_THROWS_AS(shade(blind, small), std::invalid_argument);

  struct Enough {};
  std::vector<std::size_t> reported;
  ViewOptions watched = small;
  watched.progress = [&](std::size_t done, std::size_t of) {
    CHECK(of == 18);
    reported.push_back(done);
    if (done == 5) throw Enough();
  };
  CHECK_THROWS_AS(shade(stage().subject(), watched), Enough);
  CHECK(reported == std::vector<std::size_t>{1, 2, 3, 4, 5});
}
