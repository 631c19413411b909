#include <ensonify/engine/sonar/echo/echo_former.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include <Eigen/Geometry>

#include <ensonify/engine/sonar/instrument/pulse.h>
#include <ensonify/scatter/decibel.h>

namespace ensonify::engine {

EchoFormer::EchoFormer(const Sonar& sonar, const Medium& medium, const Seafloor& seafloor,
                       std::span<const scatter::BackscatterTable> by_material,
                       const std::vector<Label>* moving)
    : labels_(seafloor, moving),
      beam_(sonar, medium.sound_speed_mps / sonar.frequency_hz),
      by_material_(by_material),
      absorption_db_per_m_(medium.absorption_db_per_m),
      profile_(medium.profile),
      bins_(sonar.bin_m(), static_cast<std::size_t>(std::ceil(
                               trace_range_m(sonar, medium.sound_speed_mps) / sonar.bin_m())) +
                               1),
      pulse_(pulse_kernel(sonar.pulse, medium.sound_speed_mps, sonar.bin_m())) {
  const refine::Bounds box = seafloor.bounds();
  lowest_ = box.lowest.head<2>().cast<double>();
  highest_ = box.highest.head<2>().cast<double>();
  for (const scatter::BackscatterTable& table : by_material) {
    strengths_from_.push_back(static_cast<std::int32_t>(strengths_.size()));
    strengths_.insert(strengths_.end(), table.values().begin(), table.values().end());
  }
  for (std::size_t bin = 0; bin < bins_.size(); ++bin) {
    const double range_m = (static_cast<double>(bin) + 0.5) * sonar.bin_m();
    gain_.push_back(
        scatter::from_db(sonar.source_level_db - 2.0 * medium.absorption_db_per_m * range_m));
  }
  energy_.resize(gain_.size() + 2 * pulse_.size());
  sums_.resize(static_cast<std::size_t>(sonar.bins));
}

void EchoFormer::form(const RayFan& fan, const RayLayout& aperture, const ReceiverMotion& reception,
                      refine::Triangles triangles, const FanRuns& runs, EchoLine& line) {
  begin(fan, aperture, reception, triangles, line);
  for (std::size_t plane = 0; plane < fan.planes(); ++plane) {
    begin_plane(plane);
    take_runs(runs, plane);
    shade();
    absorb();
    walk(plane);
    for (std::size_t i = runs.first[plane]; i < runs.first[plane + 1]; ++i)
      line.hits += runs.end[i] - runs.begin[i];
  }
  finish(line);
}

void EchoFormer::form(const RayFan& fan, const RayLayout& aperture, const ReceiverMotion& reception,
                      refine::Triangles triangles, std::span<const Hit> hits,
                      IncidenceSource& arrivals, EchoLine& line) {
  begin(fan, aperture, reception, triangles, line);
  for (std::size_t plane = 0; plane < fan.planes(); ++plane) {
    begin_plane(plane);
    claim_rays(hits, arrivals, plane);
    for (std::size_t i = 0; i < pass_.pieces; ++i) line.hits += end_[i] - begin_[i];
    shade();
    correct();
    walk(plane);
  }
  finish(line);
}

void EchoFormer::begin(const RayFan& fan, const RayLayout& aperture,
                       const ReceiverMotion& reception, refine::Triangles triangles,
                       EchoLine& line) {
  fan_ = &fan;
  aperture_ = &aperture;
  reception_ = &reception;
  triangles_ = triangles;
  side_ = line.side;
  bins_.reset();
  line.rays = aperture.rays;
  line.hits = 0;

  const std::size_t room = fan.elevations() + lane_padding;
  if (room_ < room) {
    room_ = room;
    for (auto* row : {&begin_, &end_, &index_, &breaks_, &max_rays_}) row->resize(room);
    for (auto* row : {&level_, &pole_, &distance_, &sine_, &range_m_, &energy_of_, &to_last_m_,
                      &to_end_m_, &from_m_, &until_m_})
      row->resize(room);
    for (auto* row : {&middles_, &changes_}) row->resize(4 * room);
    for (auto* row : {&weight_, &slant_, &width_rad_, &step_rad_}) row->resize(room);
    label_.resize(room);
    broken_.resize(room);
    bottom_.resize(room);
  }
  const ArrayTable& table = beam_.array_table();
  pass_ = {
      .begin = begin_.data(),
      .end = end_.data(),
      .index = index_.data(),
      .level = level_.data(),
      .pole = pole_.data(),
      .distance = distance_.data(),
      .strengths_from = bottom_.data(),
      .edge_rad = aperture.edge_rad.data(),
      .cosines = aperture.cosines.data(),
      .sines = aperture.sines.data(),
      .range_m = fan.range_m,
      .array_power = table.values().data(),
      .columns = static_cast<std::int32_t>(table.columns()),
      .reach = static_cast<float>(table.reach()),
      .transmit = {static_cast<float>(beam_.transmit().nearness_m), beam_.transmit().x_per_sine},
      .receive = {static_cast<float>(beam_.receive().nearness_m), beam_.receive().x_per_sine},
      .alike = beam_.alike(),
      .far = beam_.focused(),
      .vertical = beam_.vertical_table(side_).values().data(),
      .still = reception.still,
      .drift_along = static_cast<float>(reception.drift_along),
      .strengths = strengths_.data(),
      .bin_m = bins_.bin_m(),
      .range_m_of = range_m_.data(),
      .energy = energy_of_.data(),
      .to_last_m = to_last_m_.data(),
      .to_end_m = to_end_m_.data(),
      .middles = middles_.data(),
      .changes = changes_.data(),
      .weight = weight_.data(),
      .slant = slant_.data(),
      .width_rad = width_rad_.data(),
      .step_rad = step_rad_.data(),
      .from_m = from_m_.data(),
      .until_m = until_m_.data(),
      .breaks = breaks_.data()};
}

void EchoFormer::begin_plane(std::size_t plane) {
  bins_.begin_plane();
  const Eigen::Vector3d direction = fan_->plane_direction(plane);
  for (Eigen::Index axis = 0; axis < 3; ++axis) {
    pass_.direction[static_cast<std::size_t>(axis)] = direction[axis];
    pass_.pole_direction[static_cast<std::size_t>(axis)] = fan_->pole[axis];
  }
  const std::span<const BeamSample> samples = aperture_->samples_of(plane);
  pass_.samples = samples.data();
  pass_.sample_count = samples.size();
  const auto along = [&](const Eigen::Vector3d& vector) -> AlongPlane {
    return {static_cast<float>(vector.dot(direction)), static_cast<float>(vector.dot(fan_->pole)),
            static_cast<float>(vector.dot(reception_->drift))};
  };
  pass_.abeam = along(reception_->abeam);
  pass_.down = along(reception_->down);
  pass_.array_turn = along(reception_->array_turn);
  pass_.abeam_turn = along(reception_->abeam_turn);
  pass_.down_turn = along(reception_->down_turn);
  pass_.pieces = 0;
}

void EchoFormer::take_runs(const FanRuns& runs, std::size_t plane) {
  const std::size_t first = runs.first[plane], count = runs.first[plane + 1] - first;
  limit_runs({.begin = &runs.begin[first],
              .end = &runs.end[first],
              .level = &runs.level[first],
              .pole = &runs.pole[first],
              .runs = count,
              .edge_rad = aperture_->edge_rad.data(),
              .cosines = aperture_->cosines.data(),
              .sines = aperture_->sines.data(),
              .max_growth = max_growth,
              .most = max_rays_.data()});
  const std::uint8_t* longest = aperture_->longest.data();
  std::size_t pieces = 0;
  for (std::size_t i = 0; i < count; ++i) {
    const std::size_t run = first + i;
    const std::uint16_t label = labels_.label_of(runs.face[run]);
    // The back of a surface that has none is its front, turned.
    const double sign = runs.distance[run] > 0.0 && labels_[label].two_sided ? -1.0 : 1.0;
    const double level = sign * runs.level[run], pole = sign * runs.pole[run],
                 distance = sign * runs.distance[run];
    const std::uint32_t end_of_run = runs.end[run], most = max_rays_[i], index = runs.index[run];
    for (std::uint32_t begin = runs.begin[run]; begin < end_of_run;) {
      const std::uint32_t end = std::min({end_of_run, begin + longest[begin], begin + most});
      set_piece(pieces++, begin, end, index, label, level, pole, distance);
      begin = end;
    }
  }
  pass_.pieces = pieces;
}

// Of neighbouring bent rays on one face the middle one tells how they came: in the picture where it
// is straight, its facet is turned a little.
void EchoFormer::claim_rays(std::span<const Hit> hits, IncidenceSource& arrivals,
                            std::size_t plane) {
  const Eigen::Vector3d in_plane = fan_->plane_direction(plane);
  const Hit* of_plane = &hits[plane * fan_->elevations()];
  arrivals_.clear();
  for (const RayLayout::Stretch& stretch : aperture_->within[plane])
    for (std::size_t begin = stretch.from, end; begin < stretch.until; begin = end) {
      const std::size_t most = std::min(stretch.until, begin + aperture_->longest[begin]);
      end = begin + 1;
      if (!of_plane[begin]) continue;
      const double max_m = max_growth * of_plane[begin].t;
      while (end < most && of_plane[end].index == of_plane[begin].index &&
             std::abs(of_plane[end].t - of_plane[begin].t) <= max_m)
        ++end;
      const std::size_t middle = (begin + end - 1) / 2;
      Hit hit = of_plane[middle];
      const RayIncidence arrival = arrivals.tell(plane * fan_->elevations() + middle, hit);
      const Eigen::Vector3d a = triangles_.corner(hit.index, 0);
      Eigen::Vector3d normal = (triangles_.corner(hit.index, 1) - a)
                                   .cross(triangles_.corner(hit.index, 2) - a)
                                   .normalized();
      const std::uint16_t label = labels_.label_of(hit.face);
      double sine = -normal.dot(arrival.direction);
      if (sine < 0.0 && labels_[label].two_sided) normal = -normal, sine = -sine;
      const Eigen::Vector3d direction = fan_->direction(in_plane, middle);
      const Eigen::Vector3d straightened = arrival.straightened(normal, direction);
      const std::size_t piece = pass_.pieces++;
      sine_[piece] = std::min(sine, 1.0);
      arrivals_.push_back(arrival);
      set_piece(piece, static_cast<std::uint32_t>(begin), static_cast<std::uint32_t>(end),
                hit.index, label, straightened.dot(in_plane), straightened.dot(fan_->pole),
                hit.t * straightened.dot(direction));
    }
}

// The kernel works on whole registers: the last piece is repeated.
void EchoFormer::shade() {
  const std::size_t count = pass_.pieces;
  if (count == 0) return;
  for (std::size_t i = count; i < count + lane_padding; ++i) {
    begin_[i] = begin_[count - 1];
    end_[i] = end_[count - 1];
    index_[i] = index_[count - 1];
    level_[i] = level_[count - 1];
    pole_[i] = pole_[count - 1];
    distance_[i] = distance_[count - 1];
    bottom_[i] = bottom_[count - 1];
  }
  shade_pieces(pass_);
}

// Straight rays, where absorption depends on depth: what their own way absorbs, for what the bins'
// gain does.
void EchoFormer::absorb() {
  if (!profile_) return;
  const double from_m = -fan_->origin.z();
  for (std::size_t i = 0; i < pass_.pieces; ++i) {
    if (!answers(i)) continue;
    const double to_m = from_m - middles_[4 * i + 2];
    const double more = profile_->mean_absorption_db_per_m(from_m, to_m) - absorption_db_per_m_;
    energy_of_[i] *= scatter::from_db(-2.0 * more * range_m_[i]);
  }
}

// What bent rays have of their own: spreading, absorption, grazing angle and place. The bins' gain
// absorbs over the range that their time stands for.
void EchoFormer::correct() {
  for (std::size_t i = 0; i < pass_.pieces; ++i) {
    if (!answers(i)) continue;
    if (sine_[i] <= 0.0) {
      weight_[i] = -1.0f;
      continue;
    }
    // What the middle ray has, for what the kernel gave it in the picture.
    const RayIncidence& arrival = arrivals_[i];
    const std::size_t ray = (begin_[i] + end_[i] - 1) / 2;
    const double facing =
        level_[i] * fan_->grid->cos_elevation[ray] + pole_[i] * fan_->grid->sin_elevation[ray];
    const double range_m = distance_[i] / facing;
    const scatter::BackscatterTable& bottom = by_material_[labels_[label_[i]].sediment];
    energy_of_[i] *=
        bottom.sigma_over_sine(sine_[i]) / bottom.sigma_over_sine(std::min(-facing, 1.0)) *
        range_m * range_m / arrival.spreading_m2 *
        scatter::from_db(-2.0 * (arrival.absorption_db - absorption_db_per_m_ * range_m));
    // From that ray to the piece's middle it is none or half a step.
    const double on = (begin_[i] + end_[i] - 1) % 2 == 0 ? 0.0 : 0.5 / (end_[i] - begin_[i]);
    Eigen::Map<Eigen::Array4d> middle(&middles_[4 * i]);
    middle.head<3>() = arrival.place - fan_->origin;
    middle[3] = std::asin(sine_[i]);
    middle += on * Eigen::Map<const Eigen::Array4d>(&changes_[4 * i]);
  }
}

// Where the pieces do not go on on one surface: their ends, and what hides what.
void EchoFormer::walk(std::size_t plane) {
  const std::span<const RayLayout::Stretch> stretches = aperture_->within[plane];
  std::size_t stretch = 0;
  std::size_t last = none;  // the last surface that ended, unless its back came after it
  bool faded = false;       // it ran out of range rather than ending
  const std::size_t count = pass_.pieces;
  std::fill_n(broken_.begin(), count, std::uint8_t{0});
  for (std::size_t k = 0; k < (count > 0 ? pass_.break_count : 0); ++k) {
    const std::size_t i = breaks_[k];
    const std::size_t before = i > 0 && answers(i - 1) ? i - 1 : none;
    const bool sees = answers(i);
    if (before != none && end_[before] < begin_[i]) {
      if (end_[before] < stretches[stretch].until) {
        faded = end_in_water(before);
        last = before;
      } else {
        end_here(before);
      }
    } else if (before != none) {
      if (sees && continuous(before, i)) continue;
      end_here(before);
      faded = false;
      last = before;
      if (sees) bins_.shade(last_m(before), first_m(i), weight_[i], label_[before]);
    }
    for (; begin_[i] >= stretches[stretch].until; ++stretch) last = none;
    if (sees) {
      from_m_[i] = range_m_[i] - half_m(i);
      broken_[i] = 1;
    } else {
      last = none;  // a back: the surface's hole, not its shadow
    }
  }
  std::size_t before = count > 0 && answers(count - 1) ? count - 1 : none;
  if (before != none && end_[before] < stretches[stretch].until) {
    faded = end_in_water(before);
    last = before;
    before = none;
  } else if (before != none) {
    end_here(before);
  }
  bins_.lay(pass_, label_, broken_);
  // A surface that ends in mid-water hides all behind it, as does one that stands higher than the
  // fan; one that the fan's lower edge leaves hides nothing.
  if (stretch + 1 < stretches.size()) before = last = none;
  if (before != none) {
    const Eigen::Vector3d direction =
        fan_->direction(fan_->plane_direction(plane), end_[before] - 1);
    if (direction.z() >= 0.0) shade_beyond(before, plane);
  } else if (last != none && !faded) {
    shade_beyond(last, plane);
  }
  bins_.end_plane();
}

// How far a piece goes on from its middle where nothing joins it. A single ray keeps to its range:
// it does not tell how far its face goes.
double EchoFormer::half_m(std::size_t piece) const {
  return end_[piece] - begin_[piece] > 1 ? to_end_m_[piece] : 0.0;
}

void EchoFormer::end_here(std::size_t piece) { until_m_[piece] = range_m_[piece] + half_m(piece); }

// The next ray met nothing, perhaps because its hit is beyond the range: the surface goes on there,
// in a piece of its own, and true is returned.
bool EchoFormer::end_in_water(std::size_t piece) {
  const double next_m = onward_m(piece);
  if (!(next_m >= fan_->range_m && std::isfinite(next_m))) {
    end_here(piece);
    return false;
  }
  const std::size_t more = pass_.pieces++, end = end_[piece];
  until_m_[piece] = from_m_[more] = 0.5 * (last_m(piece) + next_m);
  until_m_[more] = next_m;
  const double half_step_rad = 0.5 * (aperture_->edge_rad[end + 1] - aperture_->edge_rad[end]);
  energy_of_[more] = energy_of_[piece] * half_step_rad / double(width_rad_[piece]);
  std::copy_n(&middles_[4 * piece], 4, &middles_[4 * more]);
  std::copy_n(&changes_[4 * piece], 4, &changes_[4 * more]);
  weight_[more] = weight_[piece];
  slant_[more] = slant_[piece];
  label_[more] = label_[piece];
  broken_[more] = 1;
  return true;
}

// Where the next ray would meet the facet if it went on; infinite if never.
double EchoFormer::onward_m(std::size_t piece) const {
  const std::size_t next = end_[piece];
  const double facing = level_[piece] * fan_->grid->cos_elevation[next] +
                        pole_[piece] * fan_->grid->sin_elevation[next];
  return facing < 0.0 ? distance_[piece] / facing : std::numeric_limits<double>::infinity();
}

// Up to the range limit, or to where the line of sight leaves the seafloor: nothing is known there.
void EchoFormer::shade_beyond(std::size_t piece, std::size_t plane) {
  const std::size_t elevation = end_[piece] - 1;
  const Eigen::Vector3d direction = fan_->direction(fan_->plane_direction(plane), elevation);
  double leaves_m = fan_->range_m;
  for (int axis = 0; axis < 2; ++axis) {
    const double speed = direction[axis];
    if (speed == 0.0) continue;
    const double border = speed > 0.0 ? highest_[axis] : lowest_[axis];
    leaves_m = std::min(leaves_m, (border - fan_->origin[axis]) / speed);
  }
  if (leaves_m > last_m(piece))
    bins_.shade(last_m(piece), leaves_m,
                static_cast<float>(beam_.two_way(side_, aperture_->samples_of(plane),
                                                 fan_->grid->cos_elevation[elevation], direction,
                                                 leaves_m, *reception_)),
                label_[piece]);
}

// As join_pieces has it; and farther apart than that two facets do not meet if it is farther than
// they are long.
bool EchoFormer::continuous(std::size_t a, std::size_t b) const {
  const auto half_run_m = [&](std::size_t piece) {
    return std::abs(to_end_m_[piece] - to_last_m_[piece]);
  };
  const double apart_m = std::abs(first_m(b) - last_m(a));
  if (apart_m > 4.0 * std::max(half_run_m(a), half_run_m(b))) return false;
  const std::vector<double>& elevation_rad = fan_->grid->elevation_rad;
  const double across_m = last_m(a) * (elevation_rad[begin_[b]] - elevation_rad[begin_[b] - 1]);
  return std::hypot(apart_m, across_m) <=
         2.0 * bins_.bin_m() + longest_edge_m(index_[a]) + longest_edge_m(index_[b]);
}

double EchoFormer::longest_edge_m(std::uint32_t index) const {
  const Eigen::Vector3d a = triangles_.corner(index, 0), b = triangles_.corner(index, 1),
                        c = triangles_.corner(index, 2);
  return std::sqrt(std::max({(b - a).squaredNorm(), (c - b).squaredNorm(), (a - c).squaredNorm()}));
}

void EchoFormer::finish(EchoLine& line) {
  bins_.tell(labels_, fan_->origin, line);
  const std::size_t margin = pulse_.size();
  for (std::size_t i = 0; i < gain_.size(); ++i) energy_[margin + i] = gain_[i] * bins_.energy(i);
  // Bins within, so that they are summed side by side.
  const double* here = &energy_[margin];
  for (std::size_t i = 0; i < sums_.size(); ++i) sums_[i] = pulse_[0] * here[i];
  for (std::size_t d = 1; d < pulse_.size(); ++d)
    for (std::size_t i = 0; i < sums_.size(); ++i)
      sums_[i] += pulse_[d] * (here[i + d] + *(here + i - d));
  for (std::size_t i = 0; i < sums_.size(); ++i) {
    line.bins.intensity_mean[i] = line.bins.intensity[i] = static_cast<float>(sums_[i]);
    line.bins.range_m[i] = static_cast<float>((static_cast<double>(i) + 0.5) * bins_.bin_m());
  }
}

}  // namespace ensonify::engine
