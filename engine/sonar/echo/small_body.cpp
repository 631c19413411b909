#include <ensonify/engine/sonar/echo/small_body.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>

#include <Eigen/Eigenvalues>

namespace ensonify::engine {

using Eigen::Matrix3d, Eigen::Vector3d;

double SmallBody::cross_section_m2(const Vector3d& to_sonar, double wavelength_m) const {
  const Vector3d direction = axes.transpose() * to_sonar;
  return scatter::small_body_cross_section(body, {direction.x(), direction.y(), direction.z()},
                                           2.0 * std::numbers::pi / wavelength_m);
}

double SmallBody::gain(double wavelength_m) const {
  const double middle_m = body.half_axes_m[1], longest_m = body.half_axes_m[2];
  return scatter::rigid_sphere_gain(2.0 * std::numbers::pi / wavelength_m *
                                    std::sqrt(middle_m * longest_m));
}

std::optional<SmallBody> small_body_of(const ObjectSurface& object, bool open,
                                       double wavelength_m) {
  // ObjectSurface::radius_m is half the diagonal of a box. For a ball it is sqrt(3) times the
  // ball's radius.
  constexpr double most_ka = 2.0;
  const double k = 2.0 * std::numbers::pi / wavelength_m;
  if (!(k * object.radius_m < std::numbers::sqrt3 * most_ka)) return std::nullopt;
  // By Gauss's theorem, the volume is a third of the integral of x n over the surface, and the
  // integral of x_i x_k over the volume is a fifth of the integral of x_i x_k x n over the surface.
  // Over a flat part x n is constant.
  const Vector3d& middle = object.middle;
  double area_m2 = 0.0, volume_m3 = 0.0;
  Vector3d of_area = Vector3d::Zero(), of_volume = Vector3d::Zero();  // first moments
  Matrix3d squares_of_area = Matrix3d::Zero(), squares_of_volume = Matrix3d::Zero();
  for (const FlatPart& flat_part : object.flat_parts) {
    const Vector3d off = flat_part.middle - middle;
    const Vector3d along = double(flat_part.length_m) * flat_part.along.cast<double>(),
                   across = double(flat_part.width_m) * flat_part.across.cast<double>();
    const double part_m2 = double(flat_part.length_m) * double(flat_part.width_m);
    const double out_m3 = part_m2 * off.dot(flat_part.normal.cast<double>());
    const double per_length2 = flat_part.round ? 0.25 / std::numbers::pi : 1.0 / 12.0;
    const Matrix3d squares = off * off.transpose() + per_length2 * (along * along.transpose() +
                                                                    across * across.transpose());
    area_m2 += part_m2;
    volume_m3 += out_m3 / 3.0;
    of_area += part_m2 * off;
    of_volume += out_m3 / 4.0 * off;
    squares_of_area += part_m2 * squares;
    squares_of_volume += out_m3 / 5.0 * squares;
  }
  constexpr double flattest = 1e-3;
  const auto about_middle = [](const Matrix3d& squares, const Vector3d& first, double size) {
    const Vector3d mean = first / size;
    return Matrix3d(squares / size - mean * mean.transpose());
  };
  const bool closed = !open && volume_m3 > 0.0;
  const double half2_per_square = closed ? 5.0 : 4.0;  // 5 for an ellipsoid, 4 for a disc
  const Eigen::SelfAdjointEigenSolver<Matrix3d> solver(
      closed ? about_middle(squares_of_volume, of_volume, volume_m3)
             : about_middle(squares_of_area, of_area, area_m2));
  const Vector3d half2 = half2_per_square * solver.eigenvalues();  // rising
  if (!(k * k * half2.z() < most_ka * most_ka)) return std::nullopt;
  SmallBody small{.body = {}, .axes = solver.eigenvectors()};
  double product_m3 = 1.0;
  for (Eigen::Index i = 0; i < 3; ++i) {
    const double half_m = std::sqrt(std::max(half2[i], flattest * flattest * half2.z()));
    small.body.half_axes_m[static_cast<std::size_t>(i)] = half_m;
    product_m3 *= half_m;
  }
  small.body.volume_m3 = closed ? volume_m3 : 4.0 / 3.0 * std::numbers::pi * product_m3;
  return small;
}

}  // namespace ensonify::engine
