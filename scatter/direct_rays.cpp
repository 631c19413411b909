#include <ensonify/scatter/direct_rays.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace ensonify::scatter {
namespace {

constexpr std::size_t max_nodes = 513;
constexpr double farthest_cotangent = 60.0;
/// Nodes are at even steps of w / (1 + w / even_up_to), where w is the cotangent.
constexpr double even_up_to = 20.0;
constexpr double node_step =
    farthest_cotangent / (1.0 + farthest_cotangent / even_up_to) / (max_nodes - 1.0);
constexpr double node_of(double w) { return w / (1.0 + w / even_up_to) / node_step; }
constexpr double cotangent_of(std::size_t node) {
  const double steps = node_step * static_cast<double>(node);
  return steps / (1.0 - steps / even_up_to);
}
constexpr double min_sine = 0.05;  // rays that are flatter anywhere are not in the tables

/// asinh(x) / x, also for small x. Up to 0.01 the next term of the series is smaller than rounding.
double asinh_over_signed(double x) {
  const double x2 = x * x;
  if (x2 > 1e-4) return std::asinh(x) / x;
  return 1.0 - x2 / 6.0 * (1.0 - x2 * 9.0 / 20.0 * (1.0 - x2 * 25.0 / 42.0));
}

/// The path of a ray down through water of one gradient. With Snell's constant xi (s/m), and with
/// the sines s and s' of the ray's angles below the horizontal and the speeds c and c' at both
/// ends, the range is xi dz (c + c') / (s + s').
struct Step {
  double range_over_xi_m2_per_s;
  double slope_m2_per_s;  // derivative of the range with respect to xi
  double time_s;
  double path_m;    // the length of the arc
  double middle_m;  // the arc's mean depth below its top

  Step(double xi, double dz, double from_mps, double to_mps, double from_sine, double to_sine,
       double gradient_per_s)
      : range_over_xi_m2_per_s(dz * (from_mps + to_mps) / (from_sine + to_sine)),
        slope_m2_per_s(range_over_xi_m2_per_s / (from_sine * to_sine)) {
    const double range_m = xi * range_over_xi_m2_per_s;
    const double chord_m = std::sqrt(range_m * range_m + dz * dz);
    const double middle_mps = std::sqrt(from_mps * to_mps);
    time_s = chord_m / middle_mps * asinh_over_signed(0.5 * gradient_per_s * chord_m / middle_mps);
    const double turn = xi * gradient_per_s * chord_m;
    path_m = chord_m * (1.0 + turn * turn / 24.0);
    middle_m = 0.5 * dz + xi * middle_mps * turn * chord_m / 12.0;
  }
};

double square(double x) { return x * x; }

}  // namespace

DirectRays::DirectRays(const SoundSpeedProfile& profile, double shallowest_m, double deepest_m)
    : profile_(&profile), shallowest_m_(shallowest_m), deepest_m_(deepest_m) {
  if (!(std::isfinite(shallowest_m) && std::isfinite(deepest_m) && shallowest_m <= deepest_m))
    throw std::invalid_argument("DirectRays: the depths must be finite, the shallower one first");
}

void DirectRays::start_at(double source_depth_m) {
  source_mps_ = profile_->speed_mps(source_depth_m);
  pieces_.clear();
  const std::vector<SoundSpeedLayer>& layers = profile_->layers();
  first_ = 0;
  for (std::size_t i = profile_->layer_index(source_depth_m);
       i < layers.size() && layers[i].top_m < deepest_m_; ++i) {
    const bool begins = pieces_.empty();
    const double top_m = begins ? source_depth_m : layers[i].top_m;
    pieces_.push_back({top_m, begins ? source_mps_ : layers[i].top_mps, layers[i].gradient_per_s,
                       layers[i].absorption_db_per_m(top_m), layers[i].db_per_m2});
    if (pieces_.back().top_m <= shallowest_m_) first_ = pieces_.size() - 1;
  }
  if (pieces_.empty())  // the source is at deepest_m
    pieces_.push_back({source_depth_m, source_mps_, 0.0,
                       profile_->mean_absorption_db_per_m(source_depth_m, source_depth_m), 0.0});
  nodes_ = 0;
  table_.resize((pieces_.size() - first_) * max_nodes);
  for (; nodes_ < max_nodes; ++nodes_) {
    const double w = cotangent_of(nodes_), hypotenuse = std::sqrt(1.0 + w * w);
    const double xi = w / (hypotenuse * source_mps_);
    const double xi_slope = 1.0 / (hypotenuse * hypotenuse * hypotenuse * source_mps_);
    double range_m = 0.0, slope_m2_per_s = 0.0, time_s = 0.0, path_m = 0.0, absorption_db = 0.0;
    double sine = 1.0 / hypotenuse;
    for (std::size_t k = 0; k < pieces_.size(); ++k) {
      const Piece& piece = pieces_[k];
      if (k >= first_)
        table_[(k - first_) * max_nodes + nodes_] = {
            range_m,
            slope_m2_per_s * xi_slope,
            time_s,
            xi * slope_m2_per_s * xi_slope,
            time_s > 0.0 ? path_m / time_s : source_mps_,
            time_s > 0.0 ? absorption_db / time_s : piece.top_db_per_m * source_mps_};
      const double end_m = k + 1 < pieces_.size() ? pieces_[k + 1].top_m : deepest_m_;
      const double end_mps = piece.top_mps + piece.gradient_per_s * (end_m - piece.top_m);
      const double sine2 = 1.0 - square(xi * end_mps);
      if (!(sine2 >= square(min_sine))) return;
      const double end_sine = std::sqrt(sine2);
      const Step step(xi, end_m - piece.top_m, piece.top_mps, end_mps, sine, end_sine,
                      piece.gradient_per_s);
      range_m += xi * step.range_over_xi_m2_per_s;
      slope_m2_per_s += step.slope_m2_per_s;
      time_s += step.time_s;
      path_m += step.path_m;
      absorption_db += step.path_m * (piece.top_db_per_m + piece.db_per_m2 * step.middle_m);
      sine = end_sine;
    }
    flattest_ = w;
  }
}

std::size_t DirectRays::piece_of(double depth_m) const {
  std::size_t k = pieces_.size() - 1;
  while (k > first_ && pieces_[k].top_m > depth_m) --k;
  return k;
}

/// Where the ray with the cotangent w is at a depth in the piece k.
DirectRays::Place DirectRays::at(double w, std::size_t k, double depth_m) const {
  const Piece& piece = pieces_[k];
  const double dz = depth_m - piece.top_m;
  const double mps = piece.top_mps + piece.gradient_per_s * dz;
  const std::size_t i = std::min(static_cast<std::size_t>(node_of(w)), nodes_ - 2);
  const Node& a = table_[(k - first_) * max_nodes + i];
  const Node& b = *(&a + 1);
  // The Hermite cubic through both nodes, with their slopes.
  const double from = cotangent_of(i), per_step = 1.0 / (cotangent_of(i + 1) - from);
  const double x = (w - from) * per_step, y = 1.0 - x, width = 1.0 / per_step;
  const double h00 = y * y * (1.0 + 2.0 * x), h01 = x * x * (1.0 + 2.0 * y);
  const double h10 = width * x * y * y, h11 = -width * x * x * y;
  const double d0 = 6.0 * x * y * per_step, d10 = y * (y - 2.0 * x), d11 = x * (x - 2.0 * y);
  const double hypotenuse2 = 1.0 + w * w, hypotenuse = std::sqrt(hypotenuse2);
  const double xi = w / (hypotenuse * source_mps_);
  const double top_sine = std::sqrt(1.0 - square(xi * piece.top_mps));
  const double sine = std::sqrt(1.0 - square(xi * mps));
  const Step step(xi, dz, piece.top_mps, mps, top_sine, sine, piece.gradient_per_s);
  const double top_s =
      h00 * a.time_s + h01 * b.time_s + h10 * a.time_slope_s + h11 * b.time_slope_s;
  return {h00 * a.range_m + h01 * b.range_m + h10 * a.range_slope_m + h11 * b.range_slope_m +
              xi * step.range_over_xi_m2_per_s,
          xi,
          {w, top_s + step.time_s, top_s * (y * a.mean_mps + x * b.mean_mps) + step.path_m,
           d0 * (b.range_m - a.range_m) + d10 * a.range_slope_m + d11 * b.range_slope_m +
               step.slope_m2_per_s / (hypotenuse2 * hypotenuse * source_mps_),
           mps,
           top_s * (y * a.mean_db_per_s + x * b.mean_db_per_s) +
               step.path_m * (piece.top_db_per_m + piece.db_per_m2 * step.middle_m)}};
}

bool DirectRays::find(double range_m, double depth_m, Eigenray& way) const {
  constexpr double close_m = 1e-5;  // its square divided by any range is negligible
  constexpr int max_rounds = 20;
  const std::size_t piece = piece_of(depth_m);
  double w = std::clamp(way.cotangent, 0.0, flattest());
  for (int round = 0; round < max_rounds; ++round) {
    const Place here = at(w, piece, depth_m);
    const double off_m = here.range_m - range_m, slope_m = here.way.range_per_cotangent_m;
    if (std::abs(off_m) < close_m) {
      // d(time) / d(range) at a constant depth is Snell's constant.
      way = here.way;
      way.cotangent = std::max(w - off_m / slope_m, 0.0);
      way.time_s -= here.xi * off_m;
      return true;
    }
    if (off_m < 0.0 && w >= flattest()) return false;
    w = std::clamp(w - off_m / slope_m, 0.0, flattest());
  }
  return false;
}

double DirectRays::follow(double cotangent, double depth_m, Eigenray& way) const {
  const Place there = at(std::clamp(cotangent, 0.0, flattest()), piece_of(depth_m), depth_m);
  way = there.way;
  way.cotangent = cotangent;
  return there.range_m;
}

double DirectRays::farthest_m(double depth_m) const {
  return at(flattest(), piece_of(depth_m), depth_m).range_m;
}

}  // namespace ensonify::scatter
