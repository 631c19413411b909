#include <ensonify/engine/seafloor/objects/object_surface.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <random>
#include <stdexcept>
#include <vector>

#include "support/catch.h"

#include <ensonify/engine/seafloor/objects/shapes.h>

using namespace ensonify;
using namespace ensonify::engine;
using Eigen::Vector3d;

namespace {

Vector3d direction(std::mt19937_64& random) {
  std::normal_distribution<double> normal;
  return Vector3d(normal(random), normal(random), normal(random)).normalized();
}

/// The least sine of the angle between a flat part's normal, or its opposite if two-sided, and the
/// direction to `from`, over some places of the flat part; above 1 where all are turned away.
double min_sine(const FlatPart& flat_part, const Vector3d& from, bool two_sided) {
  double least = 2.0;
  for (const double u : {-0.5, -0.25, 0.0, 0.25, 0.5})
    for (const double v : {-0.5, -0.25, 0.0, 0.25, 0.5}) {
      const Vector3d place = flat_part.middle +
                             u * double(flat_part.length_m) * flat_part.along.cast<double>() +
                             v * double(flat_part.width_m) * flat_part.across.cast<double>();
      const Vector3d way = (from - place).normalized(), normal = flat_part.normal.cast<double>();
      if (two_sided || normal.dot(way) > 0.0) least = std::min(least, normal.cross(way).norm());
    }
  return least;
}

/// Boxes at random places and headings; some stand in others.
refine::TriangleMesh boxes(int count, double extent_m) {
  std::mt19937_64 random(3);
  std::uniform_real_distribution<double> place_m(0.0, extent_m), turn_rad(0.0, 3.0);
  const refine::TriangleMesh box =
      make_body(shape_named("box"), {}, RandomStream(3, Purpose::test)).mesh;
  refine::TriangleMesh all;
  for (int i = 0; i < count; ++i) {
    const Eigen::Affine3f move =
        Eigen::Translation3f(
            Vector3d(place_m(random), place_m(random), 0.1 * place_m(random)).cast<float>()) *
        Eigen::AngleAxisf(static_cast<float>(turn_rad(random)), Eigen::Vector3f::UnitZ());
    const auto first = static_cast<std::uint32_t>(all.positions.size());
    for (const Eigen::Vector3f& position : box.positions) all.positions.push_back(move * position);
    for (const refine::Face& face : box.faces)
      all.faces.push_back({first + face[0], first + face[1], first + face[2]});
  }
  return all;
}

/// A flat ring in the plane z = 0, of triangles between its two circles.
refine::TriangleMesh ring(double inner_m, double outer_m, std::uint32_t sides) {
  refine::TriangleMesh mesh;
  for (std::uint32_t i = 0; i < sides; ++i)
    for (const double radius_m : {inner_m, outer_m}) {
      const double angle_rad = 2.0 * std::numbers::pi * i / sides;
      mesh.positions.emplace_back(
          (radius_m * Vector3d(std::cos(angle_rad), std::sin(angle_rad), 0.0)).cast<float>());
    }
  for (std::uint32_t i = 0; i < sides; ++i) {
    const std::uint32_t inner = 2 * i, next = 2 * ((i + 1) % sides);
    mesh.faces.push_back({inner, inner + 1, next + 1});
    mesh.faces.push_back({inner, next + 1, next});
  }
  return mesh;
}

}  // namespace

TEST_CASE("The pieces of a flat ring lie on it, and have its area and its middle") {
  for (const double inner_m : {0.6, 0.8, 1.1}) {
    CAPTURE(inner_m);
    constexpr double outer_m = 1.2;
    constexpr std::uint32_t sides = 64;
    const std::vector<FlatPart> pieces = flat_parts_of(ring(inner_m, outer_m, sides)).in_pieces();
    CHECK(pieces.size() > 16);
    CHECK(pieces.size() < 600);
    double area_m2 = 0.0;
    Vector3d first = Vector3d::Zero();
    for (const FlatPart& piece : pieces) {
      CHECK(piece.piece);
      CHECK(piece.surface == pieces[0].surface);
      CHECK(piece.middle.norm() > inner_m);
      CHECK(piece.middle.norm() < outer_m);
      const double its_m2 = double(piece.length_m) * double(piece.width_m);
      area_m2 += its_m2;
      first += its_m2 * piece.middle;
    }
    const double turn_rad = 2.0 * std::numbers::pi / sides;
    CHECK(area_m2 ==
          Approx(0.5 * sides * std::sin(turn_rad) * (outer_m * outer_m - inner_m * inner_m))
              .epsilon(1e-5));
    CHECK(first.norm() < 1e-5);
  }
}

TEST_CASE("Flat parts that are convex, or nearly so, and curved surfaces are not cut") {
  const auto is_cut = [](const refine::TriangleMesh& mesh) {
    return std::ranges::any_of(flat_parts_of(mesh).in_pieces(), &FlatPart::piece);
  };
  std::mt19937_64 random(5);
  std::uniform_real_distribution<double> share(0.0, 1.0);
  for (std::size_t i = 0; i < 200; ++i) {  // polygons on an ellipse, from triangles on
    std::vector<double> turns(3 + i % 8);
    for (double& turn : turns) turn = 2.0 * std::numbers::pi * share(random);
    std::ranges::sort(turns);
    const double width = 0.01 + share(random);
    refine::TriangleMesh mesh;
    for (const double turn : turns)
      mesh.positions.emplace_back(
          Vector3d(std::cos(turn), width * std::sin(turn), 0.0).cast<float>());
    for (std::uint32_t k = 1; k + 1 < turns.size(); ++k) mesh.faces.push_back({0, k, k + 1});
    CHECK_FALSE(is_cut(mesh));
  }
  CHECK_FALSE(is_cut(ring(0.2, 1.2, 64)));
  for (const char* shape : {"sphere", "cylinder", "box", "boulder", "tyre"})
    CHECK_FALSE(is_cut(make_body(shape_named(shape), {}, RandomStream(7, Purpose::test)).mesh));
}

TEST_CASE("The axes of a square lie along its sides, however it is turned and divided") {
  std::mt19937_64 random(11);
  std::uniform_real_distribution<double> turn_rad(0.0, 3.0), place_m(-50.0, 50.0);
  for (int i = 0; i < 60; ++i) {
    const Eigen::Affine3d move =
        Eigen::Translation3d(place_m(random), place_m(random), place_m(random)) *
        Eigen::AngleAxisd(turn_rad(random), direction(random));
    const auto cells = static_cast<std::uint32_t>(1 + i % 4);
    refine::TriangleMesh mesh;
    for (std::uint32_t row = 0; row <= cells; ++row)
      for (std::uint32_t column = 0; column <= cells; ++column)
        mesh.positions.emplace_back((move * (Vector3d(column, row, 0.0) / cells)).cast<float>());
    for (std::uint32_t row = 0; row < cells; ++row)
      for (std::uint32_t column = 0; column < cells; ++column) {
        const std::uint32_t at = row * (cells + 1) + column, above = at + cells + 1;
        mesh.faces.push_back({at, at + 1, above + 1});
        mesh.faces.push_back({at, above + 1, above});
      }
    const std::vector<FlatPart> parts = flat_parts_of(mesh).in_pieces();
    REQUIRE(parts.size() == 1);
    const Vector3d side = move.linear() * Vector3d::UnitX();
    const double cosine = std::abs(side.dot(parts[0].along.cast<double>()));
    CAPTURE(i, cosine);
    CHECK(std::min(cosine, 1.0 - cosine) < 1e-3);
  }
}

TEST_CASE("The right corners of many flat parts are those of all their pairs, in their order") {
  const std::vector<FlatPart> flat_parts = flat_parts_of(boxes(60, 12.0)).whole;
  std::vector<RightCorner> of_pairs;
  for (std::size_t i = 0; i < flat_parts.size(); ++i)
    for (std::size_t k = i + 1; k < flat_parts.size(); ++k)
      for (const RightCorner& corner :
           right_corners(std::vector<FlatPart>{flat_parts[i], flat_parts[k]}))
        of_pairs.push_back(corner);
  const std::vector<RightCorner> corners = right_corners(flat_parts);
  REQUIRE(corners.size() == of_pairs.size());
  CHECK(corners.size() > std::size_t{60 * 12});  // boxes that touch have more
  std::size_t differing = 0;
  for (std::size_t i = 0; i < corners.size(); ++i)
    if (corners[i].middle != of_pairs[i].middle || corners[i].edge != of_pairs[i].edge ||
        corners[i].length_m != of_pairs[i].length_m || corners[i].open != of_pairs[i].open ||
        corners[i].surface != corners[0].surface + i)
      ++differing;
  CHECK(differing == 0);
}

TEST_CASE("A body of many thousand planes has the corners of its boxes") {
  const std::size_t of_one = right_corners(flat_parts_of(boxes(1, 0.0)).whole).size();
  CHECK(of_one == 12);
  CHECK(right_corners(flat_parts_of(boxes(2000, 3e3)).whole).size() == 2000 * of_one);
}

TEST_CASE("The surface of a large object can be stopped at any of its steps") {
  const refine::TriangleMesh large = boxes(20'000, 1e4);
  int checks = 0;
  (void)ObjectSurface(large, 1, [&] { ++checks; });
  CHECK(checks > 10);
  for (int end = 1; end <= checks; end += 3) {
    int left = end;
    const auto stop = [&] {
      if (--left == 0) throw std::runtime_error("stopped");
    };
    CHECK_THROWS_AS(ObjectSurface(large, 1, stop), std::runtime_error);
  }
}

TEST_CASE("No flat part that faces a sonar is in a block that does not, from near and far") {
  std::mt19937_64 random(7);
  for (const char* shape : {"sphere", "cylinder", "box", "boulder", "tyre"}) {
    CAPTURE(shape);
    const ObjectSurface made(make_body(shape_named(shape), {}, RandomStream(7, Purpose::test)).mesh,
                             1);
    std::size_t in_blocks = 0;
    for (const FlatPartBlock& block : made.blocks) {
      CHECK(block.first == in_blocks);
      in_blocks += block.count;
    }
    CHECK(in_blocks == made.flat_parts.size());

    Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
    pose.rotate(Eigen::AngleAxisd(2.0, direction(random)));
    pose.pretranslate(Vector3d(100.0, -30.0, -20.0));
    ObjectSurface object = made;
    made.place_at(pose, object);
    std::size_t wrong = 0, facing = 0, blocks_left_out = 0, blocks = 0;
    for (const double distances : {1.1, 2.0, 10.0, 300.0})
      for (int way = 0; way < 10; ++way) {
        const Vector3d from = object.middle + distances * object.radius_m * direction(random);
        const bool two_sided = way % 2 == 1;
        for (const double reach : {0.01, 0.2, 0.7, 1.0})
          for (const FlatPartBlock& block : object.blocks) {
            const bool may_face = block.may_face(from, reach, two_sided);
            ++blocks;
            if (!may_face) ++blocks_left_out;
            for (std::size_t i = block.first; i < block.first + block.count; ++i)
              if (min_sine(object.flat_parts[i], from, two_sided) < reach) {
                ++facing;
                if (!may_face) ++wrong;
              }
          }
      }
    CHECK(wrong == 0);
    CHECK(facing > 100);
    // If a body has few flat parts, one block contains parts of all its sides.
    if (object.blocks.size() > 40) CHECK(blocks_left_out > blocks / 5);
  }
}
