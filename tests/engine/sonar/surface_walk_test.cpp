#include <ensonify/engine/sonar/echo/surface_walk.h>

#include <algorithm>
#include <vector>

#include "support/beds.h"
#include "support/catch.h"

using namespace ensonify;
using namespace ensonify::engine;

namespace {

constexpr double range_m = 50.0, bin_m = 0.1;

/// A piece made by hand: rays [begin, end), the range at its middle, and how much the range grows
/// from there to its last ray and to its end.
struct Hand {
  std::uint32_t begin, end;
  double range_m;
  std::uint16_t label;
  double to_last_m = 0.08, to_end_m = 0.1;
  bool answers = true;
};

/// The middle plane of a fan 10 m above a seafloor, and pieces made by hand. A piece lies on the
/// face with the number of its label: those below 5 are 2 cm long, the others 15 cm. Label 4 is an
/// object's.
class Plane {
 public:
  explicit Plane(double sector_low_rad = -0.1, int elevations = tests::plain_sonar().elevations)
      : layout_(layout_with(sector_low_rad, elevations)) {
    pose_.position = {0.0, 0.0, -10.0};
    fan_ = place_fan(layout_, pose_, starboard_sector, range_m);
    motion_ = receiver_motion(pose_, starboard_sector, range_m, 1500.0);
    number_ = fan_.planes() / 2;
    layout_.within[number_] = {{0, fan_.elevations()}};
    for (int i = 0; i < 10; ++i) {
      const float edge_m = i < 5 ? 0.02f : 0.15f;
      const auto first = static_cast<std::uint32_t>(mesh_.positions.size());
      mesh_.positions.insert(mesh_.positions.end(), {{0, 0, 0}, {edge_m, 0, 0}, {0, edge_m, 0}});
      mesh_.faces.push_back({first, first + 1, first + 2});
      seafloor_.labels.push_back({1, 1, static_cast<std::uint16_t>(i == 4)});
    }
  }

  std::uint32_t rays() const { return static_cast<std::uint32_t>(fan_.elevations()); }
  Eigen::Vector3d ray(std::size_t elevation) const {
    return fan_.direction(fan_.plane_direction(number_), elevation);
  }
  /// The first ray that meets level ground 10 m below no nearer than that.
  std::uint32_t first_ray_beyond(double ground_range_m) const {
    std::uint32_t j = 0;
    while (ray(j).z() * ground_range_m < -10.0) ++j;
    return j;
  }
  const std::vector<double>& elevation_rad() const { return fan_.grid->elevation_rad; }
  /// Within the beam: rays up to one, and those from another on.
  void part_beam(std::size_t until, std::size_t from) {
    layout_.within[number_] = {{0, until}, {from, fan_.elevations()}};
  }

  void fill(const std::vector<Hand>& hands) {
    pieces.make_room(fan_.elevations());
    pieces.clear();
    for (const Hand& hand : hands) {
      const std::size_t i = pieces.count;
      const std::size_t middle = (hand.begin + hand.end) / 2;
      // A facet across the line of sight: at the next ray it has nearly the same range.
      pieces.add({.begin = hand.begin,
                  .end = hand.end,
                  .index = hand.label,
                  .label = hand.label,
                  .level = -fan_.grid->cos_elevation[middle],
                  .pole = -fan_.grid->sin_elevation[middle],
                  .distance = -hand.range_m});
      pieces.range_m[i] = hand.range_m;
      pieces.to_last_m[i] = hand.to_last_m;
      pieces.to_end_m[i] = hand.to_end_m;
      pieces.answers[i] = hand.answers;
      pieces.beam_weight[i] = 0.125f * static_cast<float>(hand.label);
      pieces.width_rad[i] = 0.5f;
      pieces.energy[i] = 1.0;
      pieces.from_m[i] = pieces.until_m[i] = -1.0;  // where pieces meet, the kernel's
      pieces.breaks[pieces.break_count++] = static_cast<std::uint32_t>(i);
    }
  }
  /// Puts a piece on ground below the sonar that rises by an angle; returns where a ray meets it.
  double lay_slope(std::size_t piece, double rise_rad, std::size_t elevation) {
    const Eigen::Vector3d normal(-std::sin(rise_rad), 0.0, std::cos(rise_rad));
    pieces.level[piece] = fan_.plane_direction(number_).dot(normal);
    pieces.pole[piece] = fan_.pole.dot(normal);
    pieces.distance[piece] = -2.0;
    return -2.0 / ray(elevation).dot(normal);
  }
  /// Puts a piece on level ground 10 m below.
  void lay_level(std::size_t piece) {
    pieces.level[piece] = fan_.plane_direction(number_).z();
    pieces.pole[piece] = fan_.pole.z();
    pieces.distance[piece] = -10.0;
  }
  std::vector<Shadow> walk(double east_m = 100.0) {
    SurfaceWalk walk({-100.0, -100.0}, {east_m, 100.0}, bin_m);
    const FaceLabels labels(seafloor_);
    walk.walk({1, &beam_, &fan_, &layout_, &motion_, mesh_, &labels}, number_, pieces);
    return {walk.shadows().begin(), walk.shadows().end()};
  }
  std::vector<Shadow> walk(const std::vector<Hand>& hands) {
    fill(hands);
    return walk();
  }

  PieceTable pieces;

 private:
  static RayLayout layout_with(double sector_low_rad, int elevations) {
    Sonar sonar = tests::plain_sonar();
    sonar.elevations = elevations;
    sonar.sector_low_rad = sector_low_rad;
    return make_ray_layout(sonar, 0.00375, 5.0);
  }

  RayLayout layout_;
  Pose pose_;
  RayFan fan_;
  ReceiverMotion motion_;
  refine::TriangleMesh mesh_;
  Seafloor seafloor_;
  Beam beam_{tests::plain_sonar(), 0.00375};
  std::size_t number_;
};

}  // namespace

TEST_CASE("pieces that meet are one surface, without a shadow between them") {
  Plane plane;
  // The first run ends with a ray at 12.08 m, and the next run begins with a ray at 12.1 m: 2 cm
  // between the runs, and 2 cm from ray to ray.
  const auto shadows =
      plane.walk({{100, 110, 12.0, 1}, {110, 120, 12.18, 2}, {120, 130, 12.36, 1}});
  CHECK(plane.pieces.starts_surface[0] == 1);
  CHECK(plane.pieces.starts_surface[1] == 0);
  CHECK(plane.pieces.starts_surface[2] == 0);
  CHECK(plane.pieces.from_m[0] == Approx(11.9));
  CHECK(plane.pieces.until_m[0] == -1.0);
  CHECK(plane.pieces.from_m[1] == -1.0);
  CHECK(plane.pieces.until_m[2] == Approx(12.46));
  REQUIRE(shadows.size() == 1);  // behind its end in the water
  CHECK(shadows[0].from_m == Approx(12.44));
}

TEST_CASE("the lower of two surfaces that break apart hides what lies between them") {
  Plane plane;
  const auto shadows = plane.walk({{100, 110, 12.0, 3}, {110, 120, 20.0, 2}});
  CHECK(plane.pieces.starts_surface[1] == 1);
  CHECK(plane.pieces.until_m[0] == Approx(12.1));
  CHECK(plane.pieces.from_m[1] == Approx(19.9));
  REQUIRE(shadows.size() == 2);
  CHECK(shadows[0].from_m == Approx(12.08));
  CHECK(shadows[0].until_m == Approx(19.92));
  CHECK(shadows[0].label == 3);
  CHECK(shadows[0].beam_weight == 0.25f);  // that of the surface behind
  CHECK(shadows[1].label == 2);
}

TEST_CASE("two facets meet across a gap that is no longer than they are") {
  // Steep facets, 0.2 m from ray to ray, and 0.5 m between them.
  for (const std::uint16_t label : {std::uint16_t{1}, std::uint16_t{5}}) {
    Plane plane;
    const auto shadows = plane.walk(
        {{100, 102, 12.0, label, 0.2, 0.4}, {102, 104, 12.9, std::uint16_t(label + 1), 0.2, 0.4}});
    CAPTURE(label);
    CHECK(plane.pieces.starts_surface[1] == (label == 1 ? 1 : 0));
    CHECK(shadows.size() == (label == 1 ? 2 : 1));
  }
  // Nor do long ones where the gap is longer than twice the way from ray to ray.
  Plane plane;
  plane.walk({{100, 102, 12.0, 5, 0.2, 0.3}, {102, 104, 12.9, 6, 0.2, 0.3}});
  CHECK(plane.pieces.starts_surface[1] == 1);
}

TEST_CASE("two facets with unknown bed between them meet if one lies in the plane of the other") {
  Plane plane(-0.1, 100);
  const auto walked = [&](bool below_level, bool above_level) {
    const std::uint32_t j = plane.first_ray_beyond(20.0), k = j + 1;
    const double a_m = -10.0 / plane.ray(j).z(), b_m = -10.0 / plane.ray(k).z();
    // Facets of 2 cm, and half a metre and more between the rays.
    plane.fill({{j, k, a_m, 1, 0.0, 0.5 * (b_m - a_m)}, {k, k + 1, b_m, 2, 0.0, 0.1}});
    REQUIRE(b_m - a_m > 2.0 * bin_m + 0.06);
    if (below_level) plane.lay_level(0);
    if (above_level) plane.lay_level(1);
    const auto shadows = plane.walk();
    return std::pair(plane.pieces.starts_surface[1] == 1, shadows.size());
  };
  CHECK(walked(true, true) == std::pair(false, std::size_t{1}));  // only that behind the last
  CHECK(walked(true, false) == std::pair(false, std::size_t{1}));
  CHECK(walked(false, true) == std::pair(false, std::size_t{1}));
  CHECK(walked(false, false) == std::pair(true, std::size_t{2}));
}

TEST_CASE("above the horizontal two facets meet if each lies in the plane of the other") {
  Plane plane(-0.3, 300);
  std::uint32_t j = 0;
  while (plane.ray(j).z() < 0.1) ++j;
  const auto walked = [&](bool below_rises, bool above_rises) {
    constexpr double rise_rad = 0.2;
    plane.fill({{j, j + 1, 1.0, 1, 0.0, 0.1}, {j + 1, j + 2, 1.0, 2, 0.0, 0.1}});
    const double a_m = plane.lay_slope(0, rise_rad, j), b_m = plane.lay_slope(1, rise_rad, j + 1);
    REQUIRE(b_m - a_m > 2.0 * bin_m + 0.06);
    plane.fill({{j, j + 1, a_m, 1, 0.0, 0.1}, {j + 1, j + 2, b_m, 2, 0.0, 0.1}});
    if (below_rises) plane.lay_slope(0, rise_rad, j);
    if (above_rises) plane.lay_slope(1, rise_rad, j + 1);
    plane.walk();
    return plane.pieces.starts_surface[1] == 0;
  };
  CHECK(walked(true, true));
  CHECK_FALSE(walked(true, false));
  CHECK_FALSE(walked(false, true));
  CHECK_FALSE(walked(false, false));
}

TEST_CASE("a surface that ends in the water hides all behind it up to the fan's range") {
  Plane plane;
  const auto shadows = plane.walk({{100, 110, 12.0, 1}, {110, 120, 20.0, 2}});
  REQUIRE(shadows.size() == 2);
  CHECK(shadows[1].label == 2);
  CHECK(shadows[1].from_m == Approx(20.08));
  CHECK(shadows[1].until_m == Approx(range_m));
  CHECK(shadows[1].beam_weight > 0.0f);
}

TEST_CASE("the last surface that ends in the water hides what is behind, not those below it") {
  Plane plane;  // no ray from 110 to 115 hits anything
  const auto shadows = plane.walk({{100, 110, 12.0, 1}, {115, 120, 20.0, 2}});
  REQUIRE(shadows.size() == 1);
  CHECK(shadows[0].label == 2);
  CHECK(plane.pieces.until_m[0] == Approx(12.1));
  CHECK(plane.pieces.starts_surface[1] == 1);
}

TEST_CASE("a crest of the bed hides what is behind, not an object that floats above it") {
  const double object_m = GENERATE(8.0, 20.0);
  Plane plane;  // no ray from 110 to 115 hits anything
  const auto shadows = plane.walk({{100, 110, 12.0, 1}, {115, 120, object_m, 4}});
  REQUIRE(shadows.size() == 1);
  CHECK(shadows[0].label == 1);
  CHECK(shadows[0].from_m == Approx(12.08));
  CHECK(shadows[0].until_m == Approx(range_m));
}

TEST_CASE("a floating object hides the bed from where it was seen last") {
  Plane plane;
  const auto shadows = plane.walk(
      {{100, 110, 20.0, 1}, {110, 112, 8.0, 4}, {113, 115, 9.0, 4}, {115, 120, 30.0, 1}});
  const auto hidden = std::ranges::find_if(
      shadows, [](const Shadow& shadow) { return shadow.from_m < shadow.until_m; });
  REQUIRE(hidden != shadows.end());
  CHECK(hidden->label == 4);
  CHECK(hidden->from_m == Approx(20.1));
  CHECK(hidden->until_m == Approx(29.92));
  CHECK(std::none_of(hidden + 1, shadows.end(),
                     [](const Shadow& shadow) { return shadow.until_m < 29.0; }));
}

TEST_CASE("a surface's back is a hole in it, and nothing casts a shadow there") {
  Plane plane;
  CHECK(plane.walk({{100, 110, 12.0, 1}, {110, 120, 20.0, 2, 0.08, 0.1, false}}).empty());
  CHECK(plane.pieces.until_m[0] == Approx(12.1));
  const auto shadows = plane.walk({{100, 110, 20.0, 2, 0.08, 0.1, false}, {110, 120, 12.0, 1}});
  REQUIRE(shadows.size() == 1);
  CHECK(shadows[0].label == 1);
  CHECK(shadows[0].from_m == Approx(12.08));
}

TEST_CASE("a single ray keeps to its range") {
  Plane plane;
  plane.walk({{100, 101, 12.0, 1, 0.0, 0.1}, {110, 120, 20.0, 2}});
  CHECK(plane.pieces.from_m[0] == 12.0);
  CHECK(plane.pieces.until_m[0] == 12.0);
}

TEST_CASE("a surface at the fan's upper edge hides what is behind if that edge looks up") {
  for (const bool up : {false, true}) {
    Plane plane(up ? -0.1 : 0.1);
    const std::uint32_t rays = plane.rays();
    const auto shadows = plane.walk({{rays - 10, rays, 30.0, 4}});
    CAPTURE(up);
    REQUIRE(shadows.size() == (up ? 1 : 0));
    CHECK(plane.pieces.until_m[0] == Approx(30.1));
    if (up) CHECK(shadows[0].label == 4);
  }
}

TEST_CASE("a surface that leaves the beam hides nothing") {
  Plane plane;
  plane.part_beam(300, 400);
  CHECK(plane.walk({{290, 300, 12.0, 1}}).empty());
  CHECK(plane.pieces.until_m[0] == Approx(12.1));
  CHECK(plane.walk({{280, 290, 12.0, 1}}).empty());  // rays above it are in the beam again
  const auto shadows = plane.walk({{280, 290, 12.0, 1}, {400, 410, 20.0, 2}});
  REQUIRE(shadows.size() == 1);
  CHECK(shadows[0].label == 2);
}

TEST_CASE("a surface that continues beyond the range gets a piece there, and hides nothing") {
  Plane plane;
  const std::uint32_t end = plane.first_ray_beyond(range_m);
  const double next_m = -10.0 / plane.ray(end).z();
  plane.fill({{end - 3, end, 49.8, 1}});
  plane.lay_level(0);
  CHECK(plane.walk().empty());
  const PieceTable& pieces = plane.pieces;
  REQUIRE(pieces.count == 2);
  CHECK(pieces.until_m[0] == Approx(0.5 * (49.88 + next_m)));
  CHECK(pieces.from_m[1] == pieces.until_m[0]);
  CHECK(pieces.until_m[1] == Approx(next_m));
  CHECK(pieces.label[1] == 1);
  CHECK(pieces.answers[1] == 1);
  CHECK(pieces.starts_surface[1] == 1);
  // Half a step of elevation, of the half radian that the piece stands for.
  const auto& rad = plane.elevation_rad();
  const double half_step_rad = 0.25 * (rad[end + 1] - rad[end - 1]);
  CHECK(pieces.energy[1] == Approx(half_step_rad / 0.5));

  plane.fill({{end - 30, end - 20, 40.0, 1}});  // within the range it ends
  plane.lay_level(0);
  CHECK(plane.walk().size() == 1);
  CHECK(plane.pieces.count == 1);
}

TEST_CASE("a crest seen edge-on does not continue beyond the range, however far its plane does") {
  Plane plane;
  const std::uint32_t end = plane.first_ray_beyond(range_m);
  const auto walked = [&](double before_m, double last_m) {
    plane.fill({{end - 2, end - 1, before_m, 6, 0.0, 0.3}, {end - 1, end, last_m, 6, 0.0, 0.3}});
    plane.lay_level(1);  // its plane's next ray is beyond the range
    return plane.walk().size();
  };
  CHECK(walked(39.9, 40.0) == 1);
  CHECK(plane.pieces.count == 2);
  CHECK(plane.pieces.until_m[1] == 40.0);
  // Where the last step says that the range is near, the surface continues.
  CHECK(walked(48.75, 49.2) == 0);
  CHECK(plane.pieces.count == 3);
}

TEST_CASE("a shadow ends where the line of sight leaves the seafloor") {
  Plane plane;
  const std::uint32_t end = plane.first_ray_beyond(30.0);
  plane.fill({{end - 10, end, 12.0, 1}});
  const double leaves_m = 15.0 / plane.ray(end - 1).x();
  const auto shadows = plane.walk(15.0);
  REQUIRE(shadows.size() == 1);
  CHECK(shadows[0].from_m == Approx(12.08));
  CHECK(shadows[0].until_m == Approx(leaves_m));
  CHECK(leaves_m < 20.0);
  plane.fill({{end - 10, end, 17.0, 1}});
  CHECK(plane.walk(15.0).empty());  // it is outside already
}
