#include <ensonify/scatter/sound_ray.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include <ensonify/scatter/decibel.h>

namespace ensonify::scatter {
namespace {

constexpr double infinite = std::numeric_limits<double>::infinity();
constexpr double min_spreading = 0.01;  // of the path squared
// If an arc starts at a layer's edge and returns to it after a shorter path than this, its distance
// from the edge stays within nanometres, even where the speed grows by 50 m/s in a metre.
constexpr double level_arc_m = 1e-3;

// asin(x) / x and asinh(x) / x. Below series_end, the series' next term is smaller than rounding.
constexpr double series_end = 0.01;
double series(double x2) {
  return 1.0 + x2 / 6.0 * (1.0 + x2 * 9.0 / 20.0 * (1.0 + x2 * 25.0 / 42.0));
}
double asin_over(double x) { return x < series_end ? series(x * x) : std::asin(x) / x; }
double asinh_over(double x) { return x < series_end ? series(-x * x) : std::asinh(x) / x; }

}  // namespace

SoundRay::SoundRay(const SoundSpeedProfile& profile, double depth_m, double along, double down,
                   double surface_m, double bottom_m)
    : profile_(&profile), surface_m_(surface_m), bottom_m_(bottom_m) {
  if (!(depth_m >= surface_m && depth_m <= bottom_m && std::isfinite(depth_m)))
    throw std::invalid_argument("SoundRay: the source must lie between surface and bottom");
  if (!(along >= 0.0 && std::abs(along * along + down * down - 1.0) < 1e-9))
    throw std::invalid_argument(
        "SoundRay: the direction must be a unit vector with `along` not negative");
  point_ = {.depth_m = depth_m,
            .along = along,
            .down = down,
            .sound_speed_mps = profile.speed_mps(depth_m)};
  source_mps_ = point_.sound_speed_mps;
  snell_s_per_m_ = along / source_mps_;
  spread_rate_s_per_m_ = 1.0 / source_mps_;
  const std::size_t layer = profile.layer_index(depth_m);
  const bool at_top = depth_m == profile.layers()[layer].top_m;
  if ((down < 0.0 && depth_m == surface_m) || (down > 0.0 && depth_m == bottom_m))
    point_.down = -down;
  enter(at_top && point_.down < 0.0 ? layer - 1 : layer);
  if (point_.down == 0.0) settle_level();
}

void SoundRay::enter(std::size_t layer) {
  const SoundSpeedLayer& in = profile_->layers()[layer];
  layer_ = layer;
  top_m_ = std::max(in.top_m, surface_m_);
  lower_m_ = std::min(in.bottom_m, bottom_m_);
  gradient_per_s_ = in.gradient_per_s;
  exit_ = find_exit();
}

// A level ray at an edge bends into the layer in which the speed decreases away from the edge. If
// there is no such layer, at a duct's axis or along surface or bottom, the ray runs straight on.
void SoundRay::settle_level() {
  const auto& layers = profile_->layers();
  const double z = point_.depth_m;
  const bool at_top = z == top_m_, at_lower = z == lower_m_;
  if (!at_top && !at_lower) return;
  const std::size_t below = at_top ? layer_ : layer_ + 1, above = below - 1;
  if (z < bottom_m_ && below < layers.size() && layers[below].gradient_per_s < 0.0) {
    enter(below);
  } else if (z > surface_m_ && below > 0 && layers[above].gradient_per_s > 0.0) {
    enter(above);
  } else {
    gradient_per_s_ = 0.0;
    exit_ = find_exit();
  }
}

/// The length of the arc over a chord. The sine of half the arc's angle is chord * curvature / 2.
double SoundRay::arc_m(double chord_m) const {
  return chord_m * asin_over(std::min(0.5 * chord_m * std::abs(curvature_per_m()), 1.0));
}

SoundRay::Exit SoundRay::find_exit() const {
  const double s = point_.down, c = point_.sound_speed_mps, g = gradient_per_s_;
  if (s == 0.0 && g == 0.0) return {infinite, point_.depth_m, 0.0, infinite};
  const auto sine2_at = [&](double depth_m) {  // Snell: sin^2 + (snell c)^2 = 1 at both depths
    const double dz = depth_m - point_.depth_m;
    return s * s - snell_s_per_m_ * snell_s_per_m_ * g * dz * (2.0 * c + g * dz);
  };
  const bool downwards = s > 0.0 || (s == 0.0 && g < 0.0);
  double edge_m = downwards ? lower_m_ : top_m_;
  if (std::isinf(edge_m)) return {infinite, edge_m, s, snell_s_per_m_ > 0.0 ? infinite : 0.0};
  double sine2 = sine2_at(edge_m);
  const bool turns = sine2 < 0.0;
  if (turns) {
    edge_m = downwards ? top_m_ : lower_m_;
    sine2 = std::max(sine2_at(edge_m), 0.0);
  }
  const double out = downwards != turns ? std::sqrt(sine2) : -std::sqrt(sine2);
  const double dz = edge_m - point_.depth_m;
  const double range_m = turns ? (s - out) / (snell_s_per_m_ * g)
                               : snell_s_per_m_ * dz * (2.0 * c + g * dz) / (s + out);
  return {arc_m(std::hypot(range_m, dz)), edge_m, out, range_m};
}

double SoundRay::path_to_range_m(double range_m) const {
  const double dr = range_m - point_.range_m;
  if (dr > exit_.range_m || dr == infinite) return infinite;
  const double turn = curvature_per_m() * dr, down = point_.down - turn;
  const double along =
      std::sqrt(std::max(point_.along * point_.along + turn * (point_.down + down), 0.0));
  const double dz = dr * (point_.down + down) / (point_.along + along);
  return arc_m(std::hypot(dr, dz));
}

void SoundRay::advance(double path_m) {
  if (path_m >= exit_.path_m) {
    const double chord_m = std::hypot(exit_.range_m, exit_.depth_m - point_.depth_m);
    const double mps = point_.sound_speed_mps + gradient_per_s_ * (exit_.depth_m - point_.depth_m);
    move(chord_m, exit_.path_m, exit_.range_m, exit_.depth_m, snell_s_per_m_ * mps, exit_.down);
    cross();
    return;
  }
  const double half = 0.5 * curvature_per_m() * path_m;  // half the angle by which it turns up
  const double sin_half = std::sin(half), cos_half = std::cos(half);
  const double chord_m = half == 0.0 ? path_m : path_m * sin_half / half;
  const double along = point_.along * cos_half + point_.down * sin_half;  // halfway
  const double down = point_.down * cos_half - point_.along * sin_half;
  move(chord_m, path_m, chord_m * along,
       path_m < 0.0 ? point_.depth_m + chord_m * down
                    : std::clamp(point_.depth_m + chord_m * down, top_m_, lower_m_),
       along * cos_half + down * sin_half, down * cos_half - along * sin_half);
  exit_ = find_exit();
}

/// Moves to the end of a chord of the arc. The time between two points of one gradient is
/// acosh(1 + (g chord)^2 / (2 c c')) / |g| = 2 asinh(|g| chord / (2 sqrt(c c'))) / |g|.
void SoundRay::move(double chord_m, double path_m, double range_m, double depth_m, double along,
                    double down) {
  const double dz = depth_m - point_.depth_m;
  const double from_mps = point_.sound_speed_mps, to_mps = from_mps + gradient_per_s_ * dz;
  const double middle_mps = std::sqrt(from_mps * to_mps);
  const double x = 0.5 * std::abs(gradient_per_s_ * chord_m) / middle_mps;
  // The integral of c along the arc is range / snell. For steep rays this is nearly 0 / 0. They do
  // not turn within an arc, so another form of the integral is used.
  const double swept = point_.along > 0.5 ? range_m / snell_s_per_m_
                       : dz == 0.0        ? 0.0
                                          : dz * (from_mps + to_mps) / (point_.down + down);
  // The mean depth of the arc is the mean of its ends' depths plus the mean distance of the arc
  // from its chord. This distance is computed to the fourth order of the arc's angle.
  const double half = 0.5 * curvature_per_m() * path_m;
  const double bow_m = half * path_m / 12.0 * (point_.along + along) * (1.0 + 0.4 * half * half);
  const double mean_m = point_.depth_m + 0.5 * dz + bow_m;
  point_.absorption_db += path_m * profile_->layers()[layer_].absorption_db_per_m(mean_m);
  point_.range_m += range_m;
  point_.depth_m = depth_m;
  point_.time_s += chord_m / middle_mps * asinh_over(x);
  point_.path_m += path_m;
  point_.along = along;
  point_.down = down;
  point_.sound_speed_mps = to_mps;
  swept_m2_per_s_ += swept;
  spread_m_ += spread_rate_s_per_m_ * swept;
}

// Two neighbouring rays cross an edge at different ranges. Between these two ranges, one ray is
// bent by the gradient before the edge and the other by the gradient behind it. So p grows by q
// snell^2 (g_before - g_behind) / sin. At a reflection, the water behind the edge is the mirror
// image of the water before it, so its gradient is -g.
void SoundRay::cross() {
  const double before_per_s = gradient_per_s_, sine = point_.down;
  if (sine == 0.0) {
    settle_level();
    return;
  }
  const bool leaving_down = sine > 0.0;
  const bool wall = leaving_down ? exit_.depth_m == bottom_m_ : exit_.depth_m == surface_m_;
  double behind_per_s = -before_per_s;
  if (wall) {
    point_.down = -sine;
    ++reflections_;
    exit_ = find_exit();
  } else {
    enter(leaving_down ? layer_ + 1 : layer_ - 1);
    point_.sound_speed_mps =
        leaving_down ? profile_->layers()[layer_].top_mps : profile_->layers()[layer_].bottom_mps;
    // In a duct that has its axis here, such arcs would follow each other without end.
    if (exit_.depth_m == point_.depth_m && exit_.path_m < level_arc_m) {
      point_.down = 0.0;
      settle_level();
      return;
    }
    behind_per_s = gradient_per_s_;
  }
  spread_rate_s_per_m_ +=
      spread_m_ * snell_s_per_m_ * snell_s_per_m_ * (before_per_s - behind_per_s) / sine;
}

double SoundRay::spreading_m2() const {
  return std::max(std::abs(spread_m_) * sideways_m(),
                  min_spreading * point_.path_m * point_.path_m);
}

double SoundRay::spreading_back_m2() const {
  const double ratio = source_mps_ / point_.sound_speed_mps;
  return spreading_m2() * ratio * ratio;
}

double SoundRay::loss_db() const {
  if (point_.path_m == 0.0) return 0.0;
  return to_db(spreading_m2() * source_mps_ / point_.sound_speed_mps);
}

}  // namespace ensonify::scatter
