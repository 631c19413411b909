#include <ensonify/engine/sonar/echo/surface_walk.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include <Eigen/Geometry>

namespace ensonify::engine {

void SurfaceWalk::walk(const SectorView& view, std::size_t plane, PieceTable& pieces) {
  view_ = &view;
  plane_ = plane;
  pieces_ = &pieces;
  stretches_ = view.layout->within[plane];
  caster_ = crest_ = none;
  seen_ = 0;
  last_bed_m_ = 0.0;
  shadows_.clear();
  const std::size_t count = pieces.count;  // the walk may add some behind
  if (count == 0) return;
  std::fill_n(pieces.starts_surface.begin(), count, std::uint8_t{0});
  for (std::size_t k = 0; k < pieces.break_count; ++k) {
    const std::size_t piece = pieces.breaks[k];
    if (piece > 0 && pieces.answers[piece - 1]) {
      if (continues(piece - 1, piece)) continue;
      end_surface(piece - 1, piece);
    }
    for (; pieces.begin[piece] >= stretches_.front().until; stretches_ = stretches_.subspan(1))
      caster_ = crest_ = none;
    if (pieces.answers[piece])
      begin_surface(piece);
    else
      caster_ = crest_ = none;  // the back of a face: a hole in the surface, not a shadow
  }
  end_plane(count - 1);
}

bool SurfaceWalk::continues(std::size_t a, std::size_t b) const {
  return pieces_->end[a] == pieces_->begin[b] && pieces_->answers[b] && meet(a, b);
}

// Whether two pieces belong to one surface. If the gap between them is no longer than their facets,
// find_breaks() (echo_kernel.cpp) has the rule. If it is longer, leads_to() must hold in one
// direction where rays skip facets even on level ground, and otherwise in both directions.
bool SurfaceWalk::meet(std::size_t a, std::size_t b) const {
  const PieceTable& pieces = *pieces_;
  const RayFan& fan = *view_->fan;
  const std::size_t before = pieces.end[a] - std::size_t{1}, after = pieces.begin[b];
  const double a_m = pieces.last_ray_m(a), b_m = pieces.first_ray_m(b);
  const double apart_m = std::abs(b_m - a_m);
  const double across_m = a_m * (fan.grid->elevation_rad[after] - fan.grid->elevation_rad[before]);
  const double reach_m =
      2.0 * bin_m_ + longest_edge_m(pieces.index[a]) + longest_edge_m(pieces.index[b]);
  if (std::hypot(apart_m, across_m) <= reach_m) {
    const auto half_step_m = [&](std::size_t piece) {
      return std::abs(pieces.to_end_m[piece] - pieces.to_last_m[piece]);
    };
    return apart_m <= 4.0 * std::max(half_step_m(a), half_step_m(b));
  }
  const Eigen::Vector3d in_plane = fan.plane_direction(plane_);
  const double down = -fan.direction(in_plane, before).z();
  const double next_down = -fan.direction(in_plane, after).z();
  const double level_m = a_m * (down / next_down - 1.0);  // the step over level ground
  const bool bent = fan.bend.turn_rad > 0.0;
  const bool a_leads = bent ? has_in_plane(a, b, apart_m) : leads_to(a, after, b_m, apart_m),
             b_leads = bent ? has_in_plane(b, a, apart_m) : leads_to(b, before, a_m, apart_m);
  if (!(down > 0.0)) return a_leads && b_leads;  // this ray meets no level ground
  if (!(next_down > 0.0 && std::hypot(level_m, across_m) <= reach_m)) return a_leads || b_leads;
  // Near the turning point of bent rays, a neighbouring ray can hit much farther away.
  if (bent) return a_leads && b_leads;
  // On a slope that falls away rays step farther. A crest that is seen edge-on has a long step as
  // well, but the bed behind it does not lead back to it.
  const double longest_m =
      std::max(std::abs(on_plane_m(a, after) - a_m), std::abs(b_m - on_plane_m(b, before)));
  return std::hypot(longest_m, across_m) > reach_m && a_leads && b_leads;
}

// For two pieces with unknown bed between them: whether a ray, which met something at the range
// there_m, meets the plane of the piece at nearly that range. The ranges may differ by half the
// step between the pieces, or by two bins. Where rays step over facets on level ground, it is
// enough if one piece leads to the other, because on a rough bed the other one may face anywhere.
// An edge that casts a shadow lies far above the plane of what is seen behind it, and what is seen
// behind it lies far below the plane of the edge.
bool SurfaceWalk::leads_to(std::size_t piece, std::size_t ray, double there_m,
                           double apart_m) const {
  return std::abs(on_plane_m(piece, ray) - there_m) <= std::max(0.5 * apart_m, 2.0 * bin_m_);
}

// The test for bent rays, whose spacing is irregular: whether `other` lies near the plane of
// `piece`, as near as leads_to() demands along a straight ray.
bool SurfaceWalk::has_in_plane(std::size_t piece, std::size_t other, double apart_m) const {
  const refine::Triangles& triangles = view_->triangles;
  const std::uint32_t index = pieces_->index[piece];
  const Eigen::Vector3d corner = triangles.corner(index, 0);
  const Eigen::Vector3d normal =
      (triangles.corner(index, 1) - corner).cross(triangles.corner(index, 2) - corner).normalized();
  const auto place = [&](std::size_t i) {
    return Eigen::Map<const Eigen::Vector3d>(&pieces_->middles[4 * i]);
  };
  const double off_m = std::abs(normal.dot(place(other) - place(piece)));
  return off_m <= std::max(0.5 * apart_m, 2.0 * bin_m_) * std::sin(pieces_->middles[4 * piece + 3]);
}

// The surface does not continue in the next piece.
void SurfaceWalk::end_surface(std::size_t last, std::size_t next) {
  PieceTable& pieces = *pieces_;
  if (pieces.end[last] == pieces.begin[next]) {
    pieces.until_m[last] = pieces.range_m[last] + half_m(last);
    caster_ = last;
    if (pieces.answers[next])
      shadows_.push_back({hides_from_m(last), pieces.first_ray_m(next), pieces.beam_weight[next],
                          pieces.label[last], pieces.end[last] - std::size_t{1}});
  } else if (pieces.end[last] < stretches_.front().until) {
    end_in_water(last);
  } else {  // the surface ends where the stretch of rays ends
    pieces.until_m[last] = pieces.range_m[last] + half_m(last);
  }
}

void SurfaceWalk::begin_surface(std::size_t piece) {
  pieces_->from_m[piece] = pieces_->range_m[piece] - half_m(piece);
  pieces_->starts_surface[piece] = 1;
  if (!is_object(piece)) crest_ = none;
}

bool SurfaceWalk::is_object(std::size_t piece) const {
  const Label& label = (*view_->labels)[pieces_->label[piece]];
  return label.instance != 0 && !label.feature;
}

// The range from which a surface that ends hides others.
double SurfaceWalk::hides_from_m(std::size_t caster) {
  const double caster_m = pieces_->last_ray_m(caster);
  if (!is_object(caster)) return caster_m;
  for (std::size_t i = caster; i-- > seen_;)
    if (pieces_->answers[i] && !is_object(i)) {
      last_bed_m_ = pieces_->until_m[i];
      break;
    }
  seen_ = caster;
  return std::max(caster_m, last_bed_m_);
}

// The ray after the piece met nothing. If this is because its hit is beyond the range, the surface
// continues there and hides nothing.
void SurfaceWalk::end_in_water(std::size_t piece) {
  const double next_m = on_plane_m(piece, pieces_->end[piece]);
  if (next_m >= view_->fan->range_m && std::isfinite(next_m) && reaches_range(piece)) {
    continue_beyond_range(piece, next_m);
    caster_ = none;
  } else {
    pieces_->until_m[piece] = pieces_->range_m[piece] + half_m(piece);
    caster_ = piece;
    if (!is_object(piece)) crest_ = piece;
  }
}

void SurfaceWalk::end_plane(std::size_t last) {
  PieceTable& pieces = *pieces_;
  bool at_edge = false;  // a surface continues to the last ray of the stretch
  if (pieces.answers[last]) {
    at_edge = pieces.end[last] >= stretches_.front().until;
    if (at_edge)
      pieces.until_m[last] = pieces.range_m[last] + half_m(last);
    else
      end_in_water(last);
  }
  if (stretches_.size() > 1) return;  // there are rays above, which met nothing
  // A surface at the upper edge of a fan that looks down hides nothing.
  if (at_edge) caster_ = last_ray(last).z() >= 0.0 ? last : none;
  if (crest_ != none) caster_ = crest_;
  if (caster_ != none) shade_beyond(caster_);
}

// Whether a surface may continue from its last ray to the range limit. The plane of a facet that is
// seen nearly edge-on always does, but the facet may be a crest and end at once. So a single ray
// must be no farther from the limit than two steps between rays, or than facets reach.
bool SurfaceWalk::reaches_range(std::size_t piece) const {
  const PieceTable& pieces = *pieces_;
  if (pieces.end[piece] - pieces.begin[piece] > 1) return true;
  const double step_m = pieces.starts_surface[piece]
                            ? 0.0
                            : std::abs(pieces.last_ray_m(piece) - pieces.last_ray_m(piece - 1));
  const double near_m = 2.0 * bin_m_ + 2.0 * longest_edge_m(pieces.index[piece]);
  return view_->fan->range_m - pieces.last_ray_m(piece) <= std::max(2.0 * step_m, near_m);
}

// The direction of a piece's last ray.
Eigen::Vector3d SurfaceWalk::last_ray(std::size_t piece) const {
  const RayFan& fan = *view_->fan;
  return fan.direction(fan.plane_direction(plane_), pieces_->end[piece] - 1);
}

// How far a piece continues from its middle where nothing joins it. A single ray keeps its range,
// because the extent of its face is not known.
double SurfaceWalk::half_m(std::size_t piece) const {
  return pieces_->end[piece] - pieces_->begin[piece] > 1 ? pieces_->to_end_m[piece] : 0.0;
}

// The range at which a ray would meet the plane of a piece's facet; infinite if it never does.
double SurfaceWalk::on_plane_m(std::size_t piece, std::size_t ray) const {
  const FanGrid& grid = *view_->fan->grid;
  const double facing = pieces_->level[piece] * grid.cos_elevation[ray] +
                        pieces_->pole[piece] * grid.sin_elevation[ray];
  return facing < 0.0 ? pieces_->distance[piece] / facing : std::numeric_limits<double>::infinity();
}

// Adds the half step of elevation between a piece and the next ray as a separate piece.
void SurfaceWalk::continue_beyond_range(std::size_t piece, double next_m) {
  PieceTable& pieces = *pieces_;
  const std::size_t added = pieces.count++, end = pieces.end[piece];
  pieces.begin[added] = pieces.end[added] = pieces.end[piece];  // half a step, no ray
  pieces.until_m[piece] = pieces.from_m[added] = 0.5 * (pieces.last_ray_m(piece) + next_m);
  pieces.until_m[added] = next_m;
  const std::vector<double>& edge_rad = view_->layout->edge_rad;
  const double half_step_rad = 0.5 * (edge_rad[end + 1] - edge_rad[end]);
  pieces.energy[added] = pieces.energy[piece] * half_step_rad / double(pieces.width_rad[piece]);
  pieces.range_m[added] = pieces.range_m[piece];
  pieces.to_end_m[added] = pieces.to_end_m[piece];
  std::copy_n(&pieces.middles[4 * piece], 4, &pieces.middles[4 * added]);
  std::copy_n(&pieces.changes[4 * piece], 4, &pieces.changes[4 * added]);
  pieces.answers[added] = 1;
  pieces.beam_weight[added] = pieces.beam_weight[piece];
  pieces.aside_m[added] = pieces.aside_m[piece];
  pieces.energy_slope[added] = pieces.energy_slope[piece];
  pieces.label[added] = pieces.label[piece];
  pieces.starts_surface[added] = 1;
}

// Adds a shadow up to the range limit, or to where the line of sight leaves the seafloor; farther
// away nothing is known.
void SurfaceWalk::shade_beyond(std::size_t caster) {
  const RayFan& fan = *view_->fan;
  const Eigen::Vector3d direction = last_ray(caster);
  double leaves_m = fan.range_m;
  for (int axis = 0; axis < 2; ++axis) {
    const double speed = direction[axis];
    if (speed == 0.0) continue;
    const double border = speed > 0.0 ? highest_[axis] : lowest_[axis];
    leaves_m = std::min(leaves_m, (border - fan.origin[axis]) / speed);
  }
  const double begins_m = hides_from_m(caster);
  if (!(leaves_m > begins_m)) return;
  const double weight = view_->beam->two_way(view_->sector, view_->layout->samples_of(plane_),
                                             fan.grid->cos_elevation[pieces_->end[caster] - 1],
                                             direction, leaves_m, *view_->motion);
  shadows_.push_back({begins_m, leaves_m, static_cast<float>(weight), pieces_->label[caster],
                      pieces_->end[caster] - std::size_t{1}});
}

double SurfaceWalk::longest_edge_m(std::uint32_t index) const {
  const refine::Triangles& triangles = view_->triangles;
  const Eigen::Vector3d a = triangles.corner(index, 0), b = triangles.corner(index, 1),
                        c = triangles.corner(index, 2);
  return std::sqrt(std::max({(b - a).squaredNorm(), (c - b).squaredNorm(), (a - c).squaredNorm()}));
}

}  // namespace ensonify::engine
