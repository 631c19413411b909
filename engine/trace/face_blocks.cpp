#include <ensonify/engine/trace/face_blocks.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include <Eigen/Geometry>

#include <ensonify/engine/trace/intersector.h>

namespace ensonify::engine {
namespace {

using Eigen::Vector3d;
using Eigen::Vector3f;

constexpr double thinnest = 0x1p-50;  // of a face's length, and its rounding in double

bool before(const Vector3f& a, const Vector3f& b) {
  if (a.x() != b.x()) return a.x() < b.x();
  return a.y() != b.y() ? a.y() < b.y() : a.z() < b.z();
}

bool has_area(const Vector3f& a, const Vector3f& b, const Vector3f& c) {
  const Vector3d to_b = b.cast<double>() - a.cast<double>();
  const Vector3d to_c = c.cast<double>() - a.cast<double>();
  const double longest2 =
      std::max({to_b.squaredNorm(), to_c.squaredNorm(), (to_c - to_b).squaredNorm()});
  return to_b.cross(to_c).lpNorm<Eigen::Infinity>() > thinnest * longest2;
}

float above(double x) {
  const auto rounded = static_cast<float>(x);
  return rounded < x ? std::nextafter(rounded, std::numeric_limits<float>::infinity()) : rounded;
}

}  // namespace

void FaceBlocks::take(refine::Triangles triangles) {
  count = 0;
  const std::size_t blocks = (triangles.faces.size() + faces - 1) / faces;
  rows_of.resize(blocks * rows * faces);
  const std::size_t in_row = (blocks + together - 1) / together * together;
  boxes.resize(6 * in_row);

  constexpr float inf = std::numeric_limits<float>::infinity();
  constexpr auto largest = static_cast<float>(largest_component);
  bool sound = true;
  for (std::size_t block = 0; block < blocks && sound; ++block) {
    float* to = &rows_of[block * rows * faces];
    Vector3f low = Vector3f::Constant(inf), high = -low;
    for (std::size_t i = 0; i < faces; ++i) {
      // Places behind the last face repeat it, as a point.
      const std::size_t number = std::min(block * faces + i, triangles.faces.size() - 1);
      const refine::Face& face = triangles.faces[number];
      if (*std::ranges::max_element(face) >= triangles.positions.size()) {
        sound = false;
        break;
      }
      std::array<const Vector3f*, 3> corner;
      for (std::size_t k = 0; k < 3; ++k) corner[k] = &triangles.positions[face[k]];
      for (const Vector3f* p : corner) {
        low = low.cwiseMin(*p);
        high = high.cwiseMax(*p);
        sound &= (p->array().abs() <= largest).all();
      }
      std::size_t turn = before(*corner[1], *corner[0]) ? 1 : 0;
      if (before(*corner[2], *corner[turn])) turn = 2;
      std::rotate(corner.begin(), corner.begin() + static_cast<std::ptrdiff_t>(turn), corner.end());
      if (number != block * faces + i || !has_area(*corner[0], *corner[1], *corner[2]))
        corner[1] = corner[2] = corner[0];
      for (std::size_t k = 0; k < coordinates; ++k)
        to[k * faces + i] = (*corner[k / 3])[static_cast<Eigen::Index>(k % 3)];
      to[coordinates * faces + i] = static_cast<float>(turn);
    }
    for (Eigen::Index axis = 0; axis < 3; ++axis) {
      const double from = low[axis], until = high[axis];
      const auto middle = static_cast<float>(0.5 * (from + until));
      const auto row = static_cast<std::size_t>(axis) * in_row + block;
      boxes[row] = middle;
      boxes[row + 3 * in_row] = above(std::max(until - middle, middle - from));
    }
  }
  if (!sound) check_vertices(triangles);  // says what is wrong
  count = blocks;
  for (std::size_t row = 0; row < 6; ++row)  // the padding is never met: see FanKernel
    std::fill(boxes.begin() + static_cast<std::ptrdiff_t>(row * in_row + blocks),
              boxes.begin() + static_cast<std::ptrdiff_t>((row + 1) * in_row), 0.0f);
}

}  // namespace ensonify::engine
