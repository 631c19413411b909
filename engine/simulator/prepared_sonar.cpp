#include <ensonify/engine/simulator/prepared_sonar.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>

#include <fmt/format.h>

#include <ensonify/engine/base/units.h>
#include <ensonify/engine/image/line_layout.h>
#include <ensonify/engine/scene/tables/vertical_pattern_reader.h>
#include <ensonify/engine/seafloor/material.h>
#include <ensonify/engine/sonar/reception/recorder.h>
#include <ensonify/scatter/decibel.h>
#include <ensonify/scatter/solid_target.h>

namespace ensonify::engine {
namespace {

double nominal_altitude_m(const UsualPing& usual, const Sonar& sonar) {
  return std::min(usual.altitude_m, 0.45 * sonar.range_m);
}

void add_once(std::vector<std::string>& warnings, std::string warning) {
  if (std::ranges::find(warnings, warning) == warnings.end())
    warnings.push_back(std::move(warning));
}

scatter::BackscatterTable table_of(const std::string& name, const Scene& scene, const Sonar& sonar,
                                   double bed_sound_speed_mps, std::vector<std::string>& warnings) {
  const Material material = material_named(name, scene.materials);
  const bool relief = name == scene.seafloor.material &&
                      scene.seafloor.kind == SeafloorKind::fractal &&
                      scene.seafloor.fractal.sediments_own;
  const auto backscatter = backscatter_of(material, sonar.frequency_hz, bed_sound_speed_mps,
                                          relief ? scene.seafloor.cell_m : 0.0);
  for (std::string& warning : warnings_of(material, *backscatter, sonar.frequency_hz))
    add_once(warnings, std::move(warning));
  // Near the vertical, the rays of a plane are a quarter of a degree apart, and planes are often
  // farther apart. The rays would miss a lobe that is narrower than these distances, or one hit in
  // the lobe would stand for a whole cell. (Solids have glints instead.) With a lobe of 1.25 times
  // the distance of planes, the sum over few planes is nearest to the integral.
  const double apart_rad = planes_apart_rad(sonar, bed_sound_speed_mps / sonar.frequency_hz);
  const double resolved_rad = std::max(0.5 * degree, 1.25 * apart_rad);
  return scatter::BackscatterTable(*backscatter, as_solid(material) ? 0.0 : resolved_rad);
}

/// The strength of a bed of several materials: the strength of a bed of one material whose echo has
/// the same median. The intensity of each material's echo is taken as exponential.
class MixedBed final : public scatter::Backscatter {
 public:
  MixedBed(std::span<const MaterialInSonar> materials, std::span<const double> shares)
      : materials_(materials), shares_(shares) {}

  double cross_section(double grazing_rad) const override {
    const double sine = std::sin(grazing_rad);
    std::vector<double> means(shares_.size());
    double low = std::numeric_limits<double>::infinity(), high = 0.0;
    for (std::size_t i = 0; i < means.size(); ++i) {
      means[i] = materials_[i].table.sigma_over_sine(sine) * sine;
      if (shares_[i] == 0.0) continue;
      low = std::min(low, means[i]);
      high = std::max(high, means[i]);
    }
    constexpr int halvings = 40;
    for (int k = 0; k < halvings; ++k) {
      const double middle = std::sqrt(low * high);
      double above = 0.0;  // share of the echoes above the median of this strength
      for (std::size_t i = 0; i < means.size(); ++i)
        if (shares_[i] > 0.0) above += shares_[i] * std::exp2(-middle / means[i]);
      (above > 0.5 ? low : high) = middle;
    }
    return high;
  }

 private:
  std::span<const MaterialInSonar> materials_;
  std::span<const double> shares_;
};

/// The strength for the gains, which follow the median of the bed; without a bed, the strength of
/// the first material.
scatter::BackscatterTable bed_table(std::span<const MaterialInSonar> materials,
                                    std::span<const double> shares) {
  const auto there = [](double share) { return share > 0.0; };
  if (std::ranges::count_if(shares, there) > 1)
    return scatter::BackscatterTable(MixedBed(materials, shares));
  return materials[static_cast<std::size_t>(std::ranges::find_if(shares, there) - shares.begin())]
      .table;
}

std::vector<scatter::GroundTexture> textures_of(const Scene& scene,
                                                const std::vector<std::string>& materials) {
  if (!scene.texture) return {};
  std::vector<scatter::GroundTexture> textures(1);  // of none
  for (std::size_t i = 1; i < materials.size(); ++i)
    textures.push_back(texture_of(material_named(materials[i], scene.materials)));
  return textures;
}

ChainOptions chain_options(const Scene& scene, const UsualPing& usual, std::size_t number,
                           const PreparedSonar& its, const std::vector<std::string>& materials) {
  return {.seed = scene.seed,
          .sonar_number = number,
          .speckle = scene.speckle,
          .sound_speed_mps = its.medium.sound_speed_mps,
          .absorption_db_per_m = its.medium.absorption_db_per_m,
          .profile = scene.sea.refraction == RefractionMode::off ? nullptr : its.medium.profile,
          .heading_rad = scene.track.kind == TrackKind::file
                             ? 0.0
                             : scene.track.heading_rad + scene.motion.crab_rad,
          .nominal_altitude_m = nominal_altitude_m(usual, its.sonar),
          .nominal_speed_mps = usual.speed_mps,
          .ping_interval_s = usual.interval_s,
          .nominal_strength = [&bed_table = *its.bed_table](
                                  double sine) { return bed_table.sigma_over_sine(sine) * sine; },
          .bed = materials.size() > 1 ? sediment_of(material_named(materials[1], scene.materials))
                                      : std::nullopt,
          .textures = textures_of(scene, materials),
          .sea = scene.sea.state,
          .arrivals = scene.arrivals,
          .artefacts = scene.artefacts};
}

/// A wall of this material as a mirror; or a smooth mirror with this loss.
WallMirror wall_mirror_of(const Material& material, std::optional<double> loss_db) {
  if (loss_db) return {.smooth = scatter::from_db(-*loss_db)};
  const std::optional<scatter::Solid> solid = as_solid(material);
  if (!solid) return {};
  // SolidTarget's slopes have the variance tan^2 of the lobe's width in both directions together.
  return {.smooth = solid->smooth_specular(),
          .rough = solid->rough().specular,
          .slope = std::tan(solid->lobe_width_rad) / std::numbers::sqrt2};
}

/// Warns if the outer of several beams are faint, or if their rows leave gaps or overlap.
void warn_of_beams(const Scene& scene, const Sonar& sonar, double altitude_m,
                   double sound_speed_mps, std::vector<std::string>& warnings) {
  if (sonar.parallel_beams() == 1) return;
  constexpr double faint_db = -10.0, uneven = 0.1, step = 1.01;
  const LineArray transmitter = sonar.transmit_array(sound_speed_mps / sonar.frequency_hz);
  const double half_m = 0.5 * sonar.range_m, outer_m = sonar.beam_offset_m(sonar.beams - 1);
  const auto outer_db = [&](double range_m) {
    return scatter::to_db(transmitter.power(outer_m / range_m, range_m) /
                          transmitter.power(0.0, range_m));
  };
  // Nearer than half the range the sound is louder, so the gain may compensate more.
  double weakest_db = scatter::to_db(least_beam_share), at_m = 0.0, even_from_m = 0.0;
  for (double range_m = altitude_m; range_m < half_m; range_m *= step)
    if (const double db = outer_db(range_m); db < scatter::to_db(least_beam_share)) {
      even_from_m = step * range_m;
      if (db < weakest_db) weakest_db = db, at_m = range_m;
    }
  const auto warn = [&](double db, double range_m, const std::string& more) {
    add_once(warnings, fmt::format("sonar {}: the outermost of its {} beams gets {:.0f} dB of the "
                                   "middle's sound at {:.3g} m: shorten sonar.{}.array_length_m, "
                                   "which transmits{}",
                                   sonar.name, sonar.beams, db, range_m, sonar.name, more));
  };
  if (outer_db(half_m) < faint_db)
    warn(outer_db(half_m), half_m, "");
  else if (at_m > 0.0)
    warn(weakest_db, at_m,
         fmt::format(", or keep an altitude of {:.0f} m or more", std::ceil(even_from_m)));
  if (scene.track.kind == TrackKind::file) return;
  const double covered_m = sonar.beams * sonar.beam_spacing_m;
  const double interval_s = scene.ping_interval_s(sound_speed_mps);
  const double advance_m = scene.track.speed_mps * interval_s;
  if (std::abs(advance_m / covered_m - 1.0) > uneven)
    add_once(warnings,
             fmt::format("sonar {}: its {} beams cover {:.3g} m along the track, and the vehicle "
                         "goes {:.3g} m from ping to ping: the rows {}; they are even at "
                         "track.speed_mps = {:.3g}",
                         sonar.name, sonar.beams, covered_m, advance_m,
                         advance_m > covered_m ? "leave gaps" : "overlap", covered_m / interval_s));
}

/// Warns of a speed at which the beam has moved past most of an echo when the echo is back, if
/// there is one beam. (Of several beams the outer ones then lie as far aside, and warn_of_beams()
/// warns.)
void warn_of_speed(const PreparedSonar& its, double speed_mps, std::vector<std::string>& warnings) {
  const Sonar& sonar = its.sonar;
  if (sonar.beams > 1 || its.chain->share_of_farthest_echo() >= 0.1) return;
  add_once(warnings,
           fmt::format("sonar {}: at {:.3g} m/s its beam has moved on when the echo from {:.3g} m "
                       "is back, and gets less than a tenth of it: go slower, shorten "
                       "sonar.{}.array_length_m, or use several beams (sonar.{}.beams)",
                       sonar.name, speed_mps, sonar.range_m, sonar.name, sonar.name));
}

/// Warns of so few rays that not even a level bed has its level (engine/sonar/README.md).
void warn_of_few_rays(const Sonar& sonar, std::vector<std::string>& warnings) {
  if (sonar.elevations >= 32) return;
  add_once(warnings,
           fmt::format("sonar {}: with only {} elevations a level bed is too bright or has "
                       "false shadows: set sonar.{}.elevations to 64 or more",
                       sonar.name, sonar.elevations, sonar.name));
}

/// Warns of noise in the far part of the picture, where the gain over range has to end.
void warn_of_noise(const PreparedSonar& its, std::vector<std::string>& warnings) {
  const double noise_m = its.chain->noise_exceeds_bed_m();
  const double gain_ends_m = its.chain->recorder().gain_ends_m();
  if (noise_m == 0.0 || gain_ends_m == 0.0) return;
  add_once(
      warnings,
      fmt::format("sonar {}: beyond {:.3g} m the noise exceeds the bed's echo, and from {:.3g} m "
                  "on the time-varied gain stays the same: shorten sonar.{}.range_m, or lower "
                  "frequency_hz",
                  its.sonar.name, noise_m, gain_ends_m, its.sonar.name));
}

Calibration calibration_of(const PreparedSonar& its, const UsualPing& usual) {
  Calibration made{.absorption_db_per_m = its.medium.absorption_db_per_m,
                   .recorder = &its.chain->recorder(),
                   .row_spacing_m = usual.speed_mps * usual.interval_s / its.sonar.beams,
                   .median_share = its.chain->median_share()};
  const LineLayout layout(its.sonar);
  const auto add = [&](std::size_t sector, const std::vector<double>& of_bins,
                       std::vector<double>& columns) {
    if (of_bins.empty()) return;
    columns.resize(layout.columns());
    layout.set(sector, of_bins, columns.begin());
  };
  for (std::size_t sector = 0; sector < layout.sectors(); ++sector) {
    add(sector, its.chain->level_bed(sector), made.level_bed);
    add(sector, its.chain->automatic_gain(sector), made.automatic_gain);
    made.noise = std::max(made.noise, its.chain->noise(sector));
  }
  return made;
}

}  // namespace

std::shared_ptr<const PreparedSonar> prepare_sonar(const Scene& scene, const PreparedWater& water,
                                                   const UsualPing& usual, std::size_t number,
                                                   const Sonar& settings,
                                                   const std::vector<std::string>& materials,
                                                   std::span<const double> bed_shares,
                                                   std::vector<std::string>& warnings,
                                                   const std::function<void()>& stop_check) {
  const auto made = std::make_shared<PreparedSonar>();
  made->settings = settings;
  Sonar& sonar = made->sonar;
  sonar = settings.sampled(water.sound_speed_mps());
  if (!sonar.vertical.file.path.empty())
    sonar.vertical.measured = read_vertical_pattern(sonar.vertical.file.path);
  warn_of_beams(scene, sonar, nominal_altitude_m(usual, sonar), water.sound_speed_mps(), warnings);
  warn_of_few_rays(sonar, warnings);
  made->profile = water.profile(sonar.frequency_hz);
  made->medium = water.medium(sonar.frequency_hz, nominal_altitude_m(usual, sonar),
                              made->profile ? &*made->profile : nullptr);
  made->materials.push_back({scatter::BackscatterTable(scatter::Lambert())});  // no face has it
  for (std::size_t i = 1; i < materials.size(); ++i) {
    if (stop_check) stop_check();
    const Material material = material_named(materials[i], scene.materials);
    MaterialInSonar its{table_of(materials[i], scene, sonar, water.bed_sound_speed_mps(), warnings),
                        smooth_specular(material), sediment_of(material)};
    if (scene.arrivals.double_bounce)
      its.wall = wall_mirror_of(material, scene.arrivals.wall_loss_db);
    made->materials.push_back(std::move(its));
  }
  made->bed_table = bed_table(made->materials, bed_shares);
  ChainOptions options = chain_options(scene, usual, number, *made, materials);
  options.stop_check = stop_check;
  made->chain = std::make_unique<const SignalChain>(sonar, options);
  warn_of_speed(*made, usual.speed_mps, warnings);
  warn_of_noise(*made, warnings);
  made->calibration = calibration_of(*made, usual);
  return made;
}

}  // namespace ensonify::engine
