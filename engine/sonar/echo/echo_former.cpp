#include <ensonify/engine/sonar/echo/echo_former.h>

#include <algorithm>
#include <cmath>
#include <complex>
#include <numbers>
#include <utility>

#include <Eigen/Geometry>

#include <ensonify/engine/sonar/instrument/pulse.h>
#include <ensonify/scatter/decibel.h>

namespace ensonify::engine {
namespace {

constexpr double max_growth = 0.02;  // of a piece's range from end to end, as a share of it

std::size_t bins_of(const Sonar& sonar, const Medium& medium) {
  const double range_m = trace_range_m(sonar, medium.sound_speed_mps);
  return static_cast<std::size_t>(std::ceil(range_m / sonar.bin_m())) + 1;
}

SurfaceWalk walk_over(const Seafloor& seafloor, double bin_m) {
  const refine::Bounds box = seafloor.bounds();
  return {box.lowest.head<2>().cast<double>(), box.highest.head<2>().cast<double>(), bin_m};
}

PlaneBeam plane_beam(const SectorView& view, std::size_t plane) {
  const Beam& beam = *view.beam;
  const ReceiverMotion& motion = *view.motion;
  const std::span<const BeamSample> samples = view.layout->samples_of(plane);
  const Eigen::Vector3d direction = view.fan->plane_direction(plane);
  const auto along = [&](const Eigen::Vector3d& vector) -> AlongPlane {
    return {static_cast<float>(vector.dot(direction)),
            static_cast<float>(vector.dot(view.fan->pole)),
            static_cast<float>(vector.dot(motion.drift))};
  };
  const auto array = [&](const Beam::Array& of, const ArrayTable& table) -> PlaneBeam::Array {
    return {.power = table.values().data(),
            .columns = static_cast<std::int32_t>(table.columns()),
            .reach = static_cast<float>(table.reach()),
            .nearness_m = static_cast<float>(of.nearness_m),
            .x_per_sine = of.x_per_sine,
            .offset_m = of.offset_m,
            .zone_count = of.in_zones ? beam.zones_per_m().size() : 0};
  };
  return {.samples = samples.data(),
          .sample_count = samples.size(),
          .sin_azimuth = static_cast<float>(view.fan->grid->planes[plane].sin_azimuth),
          .transmit = array(beam.transmit(), beam.transmit_table()),
          .receive = array(beam.receive(), beam.receive_table()),
          .same_arrays = beam.same_arrays(),
          .focused = beam.focused(),
          .zones_per_m = beam.zones_per_m().data(),
          .vertical = beam.vertical_table(view.sector).values().data(),
          .steady = motion.steady,
          .abeam = along(motion.abeam),
          .down = along(motion.down),
          .array_turn = along(motion.array_turn),
          .abeam_turn = along(motion.abeam_turn),
          .down_turn = along(motion.down_turn),
          .drift_along = static_cast<float>(motion.drift_along)};
}

RayAngles ray_angles(const RayLayout& layout) {
  return {.edge_rad = layout.edge_rad.data(), .directions = layout.directions.data()};
}

}  // namespace

EchoFormer::EchoFormer(const Sonar& sonar, const Medium& medium, const Seafloor& seafloor,
                       std::span<const MaterialInSonar> materials, const std::vector<Label>* moving,
                       const ObjectSurfaces& surfaces)
    : labels_(seafloor, moving),
      materials_(materials),
      absorption_db_per_m_(medium.absorption_db_per_m),
      profile_(medium.profile),
      wavelength_m_(medium.sound_speed_mps / sonar.frequency_hz),
      bins_(sonar.bin_m(), bins_of(sonar, medium)),
      walk_(walk_over(seafloor, sonar.bin_m())),
      objects_(sonar, medium, materials, surfaces),
      pulse_(pulse_kernel(sonar.pulse, medium.sound_speed_mps, sonar.bin_m())),
      glints_(sonar.pulse, medium.sound_speed_mps, sonar.bin_m(),
              static_cast<std::size_t>(sonar.bins)),
      closing_shift_m_(0.5 * medium.sound_speed_mps *
                       sonar.pulse.closing_shift_s(sonar.frequency_hz)) {
  for (const MaterialInSonar& material : materials) {
    const std::span<const float> values = material.table.values();
    strengths_from_.push_back(static_cast<std::int32_t>(strengths_.size()));
    strengths_.insert(strengths_.end(), values.begin(), values.end());
  }
  for (std::size_t bin = 0; bin < bins_.size(); ++bin) {
    const double range_m = (static_cast<double>(bin) + 0.5) * sonar.bin_m();
    gain_.push_back(
        scatter::from_db(sonar.source_level_db - 2.0 * medium.absorption_db_per_m * range_m));
  }
  energy_.resize(gain_.size() + 2 * pulse_.weights.size());
  sums_.resize(static_cast<std::size_t>(sonar.bins));
}

void EchoFormer::form(const Beam& beam, const FanAim& aim, const FanHits& hits, EchoLine& line) {
  begin({line.sector, &beam, &aim.fan, aim.layout.get(), &aim.motion, hits.triangles, &labels_},
        line);
  objects_.find(view_, hits);
  for (std::size_t plane = 0; plane < aim.fan.planes(); ++plane) add_plane(hits, plane, line);
  finish(line);
}

/// Adds what the rays of a plane meet to the bins.
void EchoFormer::add_plane(const FanHits& hits, std::size_t plane, EchoLine& line) {
  if (hits.runs)
    cut_runs(*hits.runs, plane);
  else
    cut_hits(hits.hits, *hits.incidences, plane);
  compute(plane, line);
  if (hits.runs)
    absorb_over_depth();
  else
    correct_bent_rays();
  lay(plane);
}

void EchoFormer::form_planes(const Beam& element, const FanAim& aim, const FanHits& hits,
                             FanPlanes& planes) {
  const RayFan& fan = aim.fan;
  planes.make_room(fan.planes(), bins_.size(), sums_.size());
  planes.fan = &fan;
  planes.rays = aim.layout->rays;
  planes.hits = 0;
  const SectorView view{0, &element, &fan, aim.layout.get(), &aim.motion, hits.triangles, &labels_};
  view_ = view;
  objects_.find(view_, hits);
  sort_facets();
  auto facet = facets_.begin();
  for (std::size_t plane = 0; plane < fan.planes(); ++plane) {
    EchoLine& line = planes.lines[plane];
    begin(view, line);
    add_plane(hits, plane, line);
    const bool bent = !hits.runs;
    if (bent) find_arrivals(plane);
    for (; facet != facets_.end() && facet->plane == plane; ++facet) {
      bins_.add(facet->echo);
      if (bent)
        add_arrival(facet->echo.range_m - facet->echo.spread_m,
                    facet->echo.range_m + facet->echo.spread_m, facet->echo.energy, facet->sine);
    }
    planes.hits += line.hits;
    take_plane(plane, bent, planes);
  }
  take_glints(planes);
}

/// Sorts the echoes of small objects by the plane that is nearest.
void EchoFormer::sort_facets() {
  facets_.clear();
  for (const ObjectEcho& facet : objects_.facets()) {
    const double sine = objects_.arrival_sine(facet);
    facets_.push_back({view_.fan->nearest_plane(sine), facets_.size(), sine, shifted(facet)});
  }
  // (A stable sort would allocate memory.)
  std::ranges::sort(facets_, {},
                    [](const FacetOfPlane& facet) { return std::pair(facet.plane, facet.number); });
}

/// Finds from where the bent rays of a plane's pieces arrive: places do not tell.
void EchoFormer::find_arrivals(std::size_t plane) {
  const FanGrid& grid = *view_.fan->grid;
  arrived_.assign(bins_.size(), {});
  for (std::size_t i = 0; i < pieces_.count; ++i)
    if (pieces_.answers[i])
      add_arrival(pieces_.from_m[i], pieces_.until_m[i], pieces_.energy[i],
                  grid.planes[plane].sin_azimuth *
                      grid.cos_elevation[(pieces_.begin[i] + pieces_.end[i] - 1) / 2]);
}

void EchoFormer::add_arrival(double from_m, double until_m, double energy, double sine) {
  const auto bin_of = [&](double range_m) {
    const double last = static_cast<double>(bins_.size()) - 1.0;
    return static_cast<std::size_t>(std::clamp(range_m / bins_.bin_m(), 0.0, last));
  };
  const std::size_t first = bin_of(std::min(from_m, until_m)),
                    last = bin_of(std::max(from_m, until_m));
  const double share = energy / static_cast<double>(last - first + 1);
  for (std::size_t bin = first; bin <= last; ++bin) {
    arrived_[bin].energy += share;
    arrived_[bin].moment += share * sine;
  }
}

/// Copies what the bins have of a plane.
void EchoFormer::take_plane(std::size_t plane, bool bent, FanPlanes& planes) {
  const RayFan& fan = *view_.fan;
  EchoLine& line = planes.lines[plane];
  float* energy = planes.energy_of(plane);
  float* sine = planes.sine_of(plane);
  float *lit = planes.lit_of(plane), *shadowed = planes.shadowed_of(plane);
  // What lies in shadow has no place: it lies as far aside as the last place before it.
  double aside = fan.grid->planes[plane].sin_azimuth;
  for (std::size_t bin = 0; bin < bins_.size(); ++bin) {
    energy[bin] = static_cast<float>(gain_[bin] * bins_.energy(bin));
    const Eigen::Vector3d place = bins_.place(bin);
    const double range_m = place.norm();
    if (bent && arrived_[bin].energy > 0.0)
      aside = arrived_[bin].moment / arrived_[bin].energy;
    else if (!bent && range_m > 0.0)
      aside = place.dot(fan.array_axis) / range_m;
    sine[bin] = static_cast<float>(aside);
    lit[bin] = bins_.lit(bin);
    shadowed[bin] = bins_.shadowed(bin);
  }
  for (float* row : {energy, lit, shadowed, sine})  // to the end of the last block
    std::fill(row + bins_.size(), row + planes.bins,
              row == sine ? static_cast<float>(aside) : 0.0f);
  bins_.write(labels_, fan.origin, line);
  std::copy_n(energy, line.bins.intensity_mean.size(), line.bins.intensity_mean.begin());
  std::uint32_t* label = planes.label_of(plane);
  float* labelled = planes.labelled_of(plane);
  std::fill_n(label, planes.bins, 0u);
  std::fill_n(labelled, planes.bins, 0.0f);
  for (std::size_t bin = 0; bin < line.bins.instance.size(); ++bin) {
    label[bin] =
        line.bins.instance[bin] << 16 | line.bins.class_id[bin] << 8 | line.bins.sediment[bin];
    labelled[bin] = energy[bin] * line.bins.fraction[bin];
  }
  for (std::size_t bin = 0; bin < line.bins.range_m.size(); ++bin)
    line.bins.range_m[bin] = static_cast<float>((static_cast<double>(bin) + 0.5) * bins_.bin_m());
}

void EchoFormer::take_glints(FanPlanes& planes) {
  const RayFan& fan = *view_.fan;
  planes.glints.clear();
  for (const ObjectEcho& glint : objects_.glints()) {
    const ObjectEcho laid = shifted(glint);
    const double last = static_cast<double>(gain_.size()) - 1.0;
    const auto bin = static_cast<std::size_t>(std::clamp(laid.range_m / bins_.bin_m(), 0.0, last));
    const double turns = std::fmod(2.0 * glint.range_m / wavelength_m_, 1.0);
    const Label& label = labels_[laid.label];
    planes.glints.push_back({.range_m = laid.range_m,
                             .sine = objects_.arrival_sine(glint),
                             .field = std::polar(std::sqrt(laid.energy * gain_[bin]),
                                                 2.0 * std::numbers::pi * turns + glint.phase_rad),
                             .place = fan.origin + glint.place,
                             .label = label});
  }
}

void EchoFormer::begin(const SectorView& view, EchoLine& line) {
  view_ = view;
  bins_.reset({view.motion->abeam.x(), view.motion->abeam.y(), 0.0});
  line.rays = view.layout->rays;
  line.hits = 0;
  const std::size_t rays = view.fan->elevations();
  pieces_.make_room(rays);
  if (max_rays_.size() < rays + lane_padding) max_rays_.resize(rays + lane_padding);
}

/// Cuts runs into pieces over which the ranges, and the beam, are nearly a straight line.
void EchoFormer::cut_runs(const FanRuns& runs, std::size_t plane) {
  pieces_.clear();
  const std::size_t first = runs.first[plane], count = runs.first[plane + 1] - first;
  limit_runs({.count = count,
              .begin = &runs.begin[first],
              .end = &runs.end[first],
              .level = &runs.level[first],
              .pole = &runs.pole[first],
              .rays = ray_angles(*view_.layout),
              .max_growth = max_growth},
             max_rays_.data());
  const std::uint8_t* max_rays_from = view_.layout->max_rays_per_piece.data();
  for (std::size_t i = 0; i < count; ++i) {
    const std::size_t run = first + i;
    const std::uint16_t label = labels_.label_of(runs.face[run]);
    const Label& of_face = labels_[label];
    // The back of a two-sided face is treated as its front, turned.
    const double sign = runs.distance[run] > 0.0 && of_face.two_sided ? -1.0 : 1.0;
    PieceTable::Piece piece{.begin = runs.begin[run],
                            .end = 0,
                            .index = runs.index[run],
                            .label = label,
                            .strengths_from = strengths_from_[of_face.sediment],
                            .level = sign * runs.level[run],
                            .pole = sign * runs.pole[run],
                            .distance = sign * runs.distance[run]};
    const std::uint32_t end_of_run = runs.end[run];
    for (; piece.begin < end_of_run; piece.begin = piece.end) {
      const std::uint32_t most = std::min(std::uint32_t{max_rays_from[piece.begin]}, max_rays_[i]);
      piece.end = std::min(end_of_run, piece.begin + most);
      pieces_.add(piece);
    }
  }
}

/// Makes pieces of neighbouring bent rays on one face. The middle ray stands for all. In the
/// straightened space, in which this ray is straight, the face that it meets is turned a little.
void EchoFormer::cut_hits(std::span<const Hit> hits, IncidenceSource& incidences,
                          std::size_t plane) {
  pieces_.clear();
  arrivals_.clear();
  const RayFan& fan = *view_.fan;
  const refine::Triangles& triangles = view_.triangles;
  const Eigen::Vector3d in_plane = fan.plane_direction(plane);
  const Hit* of_plane = &hits[plane * fan.elevations()];
  for (const RayLayout::Stretch& stretch : view_.layout->within[plane])
    for (std::size_t begin = stretch.from, end; begin < stretch.until; begin = end) {
      end = begin + 1;
      if (!of_plane[begin]) continue;
      const std::size_t last_end =
          std::min(stretch.until, begin + view_.layout->max_rays_per_piece[begin]);
      const double max_m = max_growth * of_plane[begin].t;
      while (end < last_end && of_plane[end].index == of_plane[begin].index &&
             std::abs(of_plane[end].t - of_plane[begin].t) <= max_m)
        ++end;
      const std::size_t middle = (begin + end - 1) / 2;
      Hit hit = of_plane[middle];
      const RayIncidence incidence =
          incidences.incidence_of(plane * fan.elevations() + middle, hit);
      const Eigen::Vector3d a = triangles.corner(hit.index, 0);
      Eigen::Vector3d normal = (triangles.corner(hit.index, 1) - a)
                                   .cross(triangles.corner(hit.index, 2) - a)
                                   .normalized();
      const std::uint16_t label = labels_.label_of(hit.face);
      double sine = -normal.dot(incidence.direction);
      if (sine < 0.0 && labels_[label].two_sided) normal = -normal, sine = -sine;
      const Eigen::Vector3d direction = fan.direction(in_plane, middle);
      const Eigen::Vector3d straightened = incidence.straightened(normal, direction);
      arrivals_.push_back({incidence, direction, normal, std::min(sine, 1.0)});
      pieces_.add({.begin = static_cast<std::uint32_t>(begin),
                   .end = static_cast<std::uint32_t>(end),
                   .index = hit.index,
                   .label = label,
                   .strengths_from = strengths_from_[labels_[label].sediment],
                   .level = straightened.dot(in_plane),
                   .pole = straightened.dot(fan.pole),
                   .distance = hit.t * straightened.dot(direction)});
    }
}

void EchoFormer::compute(std::size_t plane, EchoLine& line) {
  for (std::size_t i = 0; i < pieces_.count; ++i) line.hits += pieces_.end[i] - pieces_.begin[i];
  if (pieces_.count == 0) return;
  pieces_.pad();
  const RayFan& fan = *view_.fan;
  const Eigen::Vector3d direction = fan.plane_direction(plane);
  pieces_.break_count =
      compute_echoes({.pieces = pieces_.geometry(),
                      .rays = ray_angles(*view_.layout),
                      .direction = {direction.x(), direction.y(), direction.z()},
                      .pole_direction = {fan.pole.x(), fan.pole.y(), fan.pole.z()},
                      .range_m = fan.range_m,
                      .bin_m = bins_.bin_m(),
                      .beam = plane_beam(view_, plane),
                      .strengths = strengths_.data()},
                     pieces_.echoes());
}

/// For straight rays, if absorption depends on depth: gain_ has the same absorption at all depths,
/// so the difference is added here.
void EchoFormer::absorb_over_depth() {
  if (!profile_) return;
  const double from_m = -view_.fan->origin.z();
  for (std::size_t i = 0; i < pieces_.count; ++i) {
    if (!pieces_.answers[i]) continue;
    const double to_m = from_m - pieces_.middles[4 * i + 2];
    const double more = profile_->mean_absorption_db_per_m(from_m, to_m) - absorption_db_per_m_;
    pieces_.energy[i] *= scatter::from_db(-2.0 * more * pieces_.range_m[i]);
  }
}

/// The kernel computed bent rays as straight rays. Replaces spreading, absorption, grazing angle
/// and place by those of the bent rays. Also replaces the changes of grazing angle and place over a
/// piece. (gain_ absorbs over the range that their travel time stands for.)
void EchoFormer::correct_bent_rays() {
  const FanGrid& grid = *view_.fan->grid;
  for (std::size_t i = 0; i < pieces_.count; ++i) {
    if (!pieces_.answers[i]) continue;
    const auto& [incidence, launch, normal, sine] = arrivals_[i];
    if (sine <= 0.0) {
      pieces_.answers[i] = 0;
      continue;
    }
    // Replaces the kernel's straight-ray factors of the middle ray by those of the bent ray.
    const std::uint32_t begin = pieces_.begin[i], end = pieces_.end[i];
    const std::size_t ray = (begin + end - 1) / 2;
    const double facing =
        pieces_.level[i] * grid.cos_elevation[ray] + pieces_.pole[i] * grid.sin_elevation[ray];
    const double range_m = pieces_.distance[i] / facing;
    const scatter::BackscatterTable& bottom = materials_[labels_[pieces_.label[i]].sediment].table;
    pieces_.energy[i] *=
        bottom.sigma_over_sine(sine) / bottom.sigma_over_sine(std::min(-facing, 1.0)) * range_m *
        range_m / incidence.spreading_m2 *
        scatter::from_db(-2.0 * (incidence.absorption_db - absorption_db_per_m_ * range_m));
    Eigen::Map<Eigen::Array4d> change(&pieces_.changes[4 * i]), middle(&pieces_.middles[4 * i]);
    const RayIncidence::Step step = incidence.in_sea(change.head<3>().matrix(), launch);
    const double grazing_rad = std::asin(sine);
    // A linear change must leave the angle positive over the whole piece.
    const double turned_rad = -normal.dot(step.turn) / std::sqrt(std::max(1.0 - sine * sine, 1e-9));
    change.head<3>() = step.displacement;
    change[3] = std::clamp(turned_rad, -2.0 * grazing_rad, 2.0 * grazing_rad);
    // Distance from the middle ray to the piece's middle, as a share of the piece: 0 for an odd
    // number of rays, else half a ray step.
    const double on = (begin + end - 1) % 2 == 0 ? 0.0 : 0.5 / (end - begin);
    middle.head<3>() = incidence.place - view_.fan->origin;
    middle[3] = grazing_rad;
    middle += on * change;
  }
}

/// ObjectEchoes adds the energy of small objects. Their pieces keep almost none; they only give the
/// labels and places.
void EchoFormer::leave_out_small_objects() {
  constexpr double almost_nothing = 1e-9;
  if (!objects_.any_small()) return;
  for (std::size_t i = 0; i < pieces_.count; ++i)
    if (objects_.small(pieces_.label[i])) pieces_.energy[i] *= almost_nothing;
}

/// Moves the places that one of several beams sees to the middles of their energy.
void EchoFormer::move_aside() {
  if (view_.beam->transmit().offset_m == 0.0f) return;
  const Eigen::Vector3d& ahead = view_.fan->array_axis;
  for (std::size_t i = 0; i < pieces_.count; ++i)
    Eigen::Map<Eigen::Vector3d>(&pieces_.middles[4 * i]) += double(pieces_.aside_m[i]) * ahead;
}

void EchoFormer::lay(std::size_t plane) {
  leave_out_small_objects();
  bins_.begin_plane();
  walk_.walk(view_, plane, pieces_);
  move_aside();
  if (!view_.motion->steady) return lay_shifted(plane);
  bins_.lay(pieces_.to_lay());
  for (const Shadow& shadow : walk_.shadows()) bins_.shade(shadow);
}

/// How much nearer than its range an echo appears. drift: the part of ReceiverMotion::drift along
/// its ray, which is the closing speed divided by c / 2.
double EchoFormer::nearer_m(double range_m, double drift) const {
  return (0.5 * range_m + closing_shift_m_) * drift;
}

/// The factor that corrects the absorption of a sweep's echo. gain_ has the absorption for the
/// range of the bin. Half of the path out and back is longer than the range of the bin, by
/// closing_shift_m_ times the drift.
double EchoFormer::absorbed_beyond_bin(double drift) const {
  constexpr double nepers_per_db = 0.1 * std::numbers::ln10;
  const double x = -2.0 * nepers_per_db * absorption_db_per_m_ * closing_shift_m_ * drift;
  return 1.0 + x * (1.0 + x * (0.5 + x / 6.0));  // exp(x), within 0.001 dB up to 1 dB
}

/// Lays pieces and shadows where the echoes of a moving sonar appear.
void EchoFormer::lay_shifted(std::size_t plane) {
  const RayFan& fan = *view_.fan;
  const double level = view_.motion->drift.dot(fan.plane_direction(plane));
  const double pole = view_.motion->drift.dot(fan.pole);
  const RayAngles rays = ray_angles(*view_.layout);
  const auto drift_at = [&](std::size_t angle) {
    return level * rays.directions[angle].cosine + pole * rays.directions[angle].sine;
  };
  const auto shift = [&](double& range_m, std::size_t angle) {
    range_m -= nearer_m(range_m, drift_at(angle));
  };
  shift_ranges({.count = pieces_.count,
                .begin = pieces_.begin.data(),
                .end = pieces_.end.data(),
                .rays = rays,
                .drift_level = level,
                .drift_pole = pole,
                .closing_shift_m = closing_shift_m_},
               pieces_.from_m.data(), pieces_.until_m.data());
  if (closing_shift_m_ != 0.0)
    for (std::size_t i = 0; i < pieces_.count; ++i)
      if (pieces_.answers[i])
        pieces_.energy[i] *= absorbed_beyond_bin(drift_at(pieces_.begin[i] + pieces_.end[i] - 1));
  bins_.lay(pieces_.to_lay());
  for (Shadow shadow : walk_.shadows()) {
    shift(shadow.from_m, 2 * shadow.ray);
    shift(shadow.until_m, 2 * shadow.ray);
    bins_.shade(shadow);
  }
}

/// Moves an object's echo to where a moving sonar receives it, as lay_shifted() does for rays.
ObjectEcho EchoFormer::shifted(ObjectEcho echo) const {
  const double drift = view_.motion->drift.dot(echo.place.normalized());
  echo.range_m -= nearer_m(echo.range_m, drift);
  echo.energy *= absorbed_beyond_bin(drift);
  return echo;
}

/// The field of the glints in each bin, and their part of the truth.
void EchoFormer::add_glints(EchoLine& line) {
  for (const ObjectEcho& glint : objects_.glints()) {
    const ObjectEcho laid = shifted(glint);
    bins_.add(laid);
    const double last = static_cast<double>(gain_.size()) - 1.0;
    const auto bin = static_cast<std::size_t>(std::clamp(laid.range_m / bins_.bin_m(), 0.0, last));
    const double turns = std::fmod(2.0 * glint.range_m / wavelength_m_, 1.0);
    glints_.add(laid.range_m, std::polar(std::sqrt(laid.energy * gain_[bin]),
                                         2.0 * std::numbers::pi * turns + glint.phase_rad));
  }
  glints_.write(line.glint_re, line.glint_im);
}

/// Writes the truth, and the bins' energy after the pulse.
void EchoFormer::finish(EchoLine& line) {
  for (const ObjectEcho& facet : objects_.facets()) bins_.add(shifted(facet));
  const std::size_t margin = pulse_.weights.size();
  for (std::size_t i = 0; i < gain_.size(); ++i) energy_[margin + i] = gain_[i] * bins_.energy(i);
  spread_by_pulse(pulse_, &energy_[margin], sums_);
  add_glints(line);
  line.walls.assign(objects_.walls().begin(), objects_.walls().end());
  bins_.write(labels_, view_.fan->origin, line);
  for (std::size_t i = 0; i < line.glint_re.size(); ++i) {
    const double re = double(line.glint_re[i]), im = double(line.glint_im[i]);
    sums_[i] += re * re + im * im;
  }
  for (std::size_t i = 0; i < sums_.size(); ++i) {
    line.bins.intensity_mean[i] = line.bins.intensity[i] = static_cast<float>(sums_[i]);
    line.bins.range_m[i] = static_cast<float>((static_cast<double>(i) + 0.5) * bins_.bin_m());
  }
}

}  // namespace ensonify::engine
