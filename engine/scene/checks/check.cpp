#include <ensonify/engine/scene/checks/check.h>

#include <algorithm>
#include <stdexcept>

#include <fmt/format.h>

#include <ensonify/engine/base/units.h>
#include <ensonify/engine/output/jsf.h>
#include <ensonify/engine/output/recording.h>
#include <ensonify/engine/output/xtf.h>
#include <ensonify/engine/scene/checks/object_check.h>
#include <ensonify/engine/scene/checks/require-inl.h>
#include <ensonify/engine/scene/keys/key_text.h>
#include <ensonify/engine/seafloor/objects/objects.h>
#include <ensonify/engine/seafloor/seafloor.h>
#include <ensonify/engine/sonar/instrument/presets.h>
#include <ensonify/scatter/backscatter.h>

namespace ensonify::engine {
namespace {

constexpr double max_grid_points = 1073741824.0;  // 2^30, because the numbers of faces have 32 bits
constexpr double max_pixels = 1e9;                // their layers take 60 GB
constexpr double max_rays = 1e8;                  // per side of one ping
constexpr double max_bins_in_pulse = 10000;
constexpr int max_bins = 65536;  // per side
// Over this width VerticalTable has nine or more values: a two-way level is then within 0.07 dB.
constexpr int max_parallel_beams = 32;
constexpr double narrowest_vertical_deg = 0.5;
constexpr double max_pings = 10e6;

void check_track(const Scene& scene, const Require& require) {
  const TrackOptions& track = scene.track;
  const bool from_file = track.kind == TrackKind::file;
  require(!from_file || !track.file.empty(), "track.kind",
          "'track.kind' is \"file\", but no file is named: give it as track.file");
  require(from_file || track.file.empty(), "track.file",
          "'track.file' needs track.kind = \"file\"");
  require(!from_file || scene.motion.speed.is_zero(), "motion.speed",
          "'motion.speed' changes the speed of a line or a lawn-mower; a track from a file has "
          "its own: leave it out");
  require(track.origin_latitude_rad.has_value() == track.origin_longitude_rad.has_value(),
          track.origin_latitude_rad ? "track.origin_lat_deg" : "track.origin_lon_deg",
          "of 'track.origin_lat_deg' and 'track.origin_lon_deg' one is missing, expected "
          "both or none");
  require(track.kind != TrackKind::lawn_mower || track.speed_mps > 0.0, "track.speed_mps",
          "'track.speed_mps' is 0, expected more for a lawn-mower, which must reach its end");
  require(!scene.output.file_per_leg || track.kind == TrackKind::lawn_mower, "output.file_per_leg",
          "'output.file_per_leg' needs legs: set track.kind = \"lawn-mower\", or use "
          "output.pings_per_file");
}

constexpr std::size_t max_elements = 256;  // elements of an array with weights

std::string sonar_key(const Sonar& sonar, std::string_view name) {
  return fmt::format("sonar.{}.{}", sonar.name, name);
}

void check_shading(const Sonar& sonar, const Require& require) {
  const auto key = [&](std::string_view name) { return sonar_key(sonar, name); };
  const auto weights = [&](ShadingKind kind, const std::vector<double>& given, bool receiver) {
    const std::string_view prefix = receiver ? "receive_" : "";
    const std::string weights_key = key(fmt::format("{}shading_weights", prefix));
    require(given.empty() || kind == ShadingKind::weights, weights_key,
            "'{}' needs {}shading = \"weights\"", weights_key, prefix);
    require(given.size() <= max_elements, weights_key, "'{}' has {} weights, expected at most {}",
            weights_key, given.size(), max_elements);
    std::string fault;
    try {
      if (receiver)
        sonar.receive_array(1.0);
      else
        sonar.transmit_array(1.0);
    } catch (const std::invalid_argument& error) {
      fault = error.what();
    }
    const std::string fault_key = kind == ShadingKind::weights ? weights_key : key("taylor_nbar");
    require(fault.empty(), fault_key, "'{}': {}", fault_key, fault);
  };
  weights(sonar.shading, sonar.shading_weights, false);
  weights(sonar.receive_shading, sonar.receive_shading_weights, true);
  require(
      sonar.focus_zones_m.empty() || !sonar.focused, key("focus_zones_m"),
      "'{0}' is given, and {1} is true: the arrays are focused either in zones or at all ranges, "
      "leave one out",
      key("focus_zones_m"), key("focused"));
}

constexpr std::size_t max_objects = max_labels - 1;  // the instance 0 is no object

/// Checks the files that the bed is made from.
void check_bed_files(const Scene& scene, const Require& require) {
  const SeafloorOptions& bed = scene.seafloor;
  const auto file_of_kind = [&](SeafloorKind kind, std::string_view name, const InputFile& file) {
    const std::string key = fmt::format("seafloor.{}", name);
    require(bed.kind != kind || !file.empty(), "seafloor.kind",
            "'seafloor.kind' is \"{0}\", but no {0} is named: give its file as {1}", name, key);
    require(bed.kind == kind || file.empty(), key, "'{}' needs seafloor.kind = \"{}\"", key, name);
  };
  require(bed.kind == SeafloorKind::fractal || bed.ripples.rms_height_m == 0.0,
          "seafloor.ripples.rms_height_m",
          "'seafloor.ripples' needs seafloor.kind = \"fractal\"; on a survey, ripples are a "
          "layer [[seafloor.crests]]");
  file_of_kind(SeafloorKind::survey, "survey", bed.survey);
  file_of_kind(SeafloorKind::mesh, "mesh", bed.mesh);
  file_of_kind(SeafloorKind::progressive, "progressive", bed.progressive);
  require(bed.kind != SeafloorKind::progressive || scene.objects.empty(), "objects.0",
          "a progressive mesh takes no more objects: put them into the scene that is analysed");
}

void check_objects(const Scene& scene, const Require& require) {
  for (std::size_t i = 0; i < scene.objects.size(); ++i)
    if (const auto fault = fault_of(scene.objects[i], fmt::format("objects.{}", i)))
      require(false, fault->key, "{}", fault->message);
  if (const auto fault = fault_of_assemblies(scene.objects))
    require(false, fault->key, "{}", fault->message);
  require(count_of(scene.objects) <= max_objects, "objects",
          "the scene has {} objects, expected at most {}, since labels have 16 bits",
          count_of(scene.objects), max_objects);
}

void check_materials(const Scene& scene, const Require& require) {
  check_material(scene, scene.seafloor.material, "seafloor.material", require);
  for (std::size_t i = 0; i < scene.objects.size(); ++i)
    check_material(scene, scene.objects[i].material, fmt::format("objects.{}.material", i),
                   require);
  for (const Material& own : scene.materials) {
    require(own.name != name_of_number_0, fmt::format("material.{}", own.name),
            "a material is named \"{}\", which is the name of number 0: expected another name",
            name_of_number_0);
    const bool from_file = own.model == "table";
    const std::string key = fmt::format("material.{}.{}", own.name, from_file ? "table" : "model");
    require(from_file || own.table.empty(), key,
            "'material.{0}.table' needs material.{0}.model = \"table\"", own.name);
    check_material(
        scene, own.name,
        from_file || own.model == "gsab" ? key : fmt::format("material.{}.like", own.name),
        require);
  }
}

void check_sea(const Scene& scene, const Require& require) {
  require(scene.sea.profile.empty() || !scene.sea.sound_speed_mps, "sea.sound_speed_mps",
          "'sea.sound_speed_mps' and 'sea.profile' are both given, expected one of them");
  require(scene.sea.refraction == RefractionMode::off || !scene.sea.profile.empty(),
          "sea.refraction",
          "'sea.refraction' is on, and there is no cast to refract by: give its file as "
          "sea.profile, or leave it \"off\"");
}

void check_fractal(const SeafloorOptions& bed, const Require& require) {
  require(bed.cell_m <= bed.extent_east_m && bed.cell_m <= bed.extent_north_m, "seafloor.cell_m",
          "'seafloor.cell_m' is {}, longer than the seabed of {} x {} m", bed.cell_m,
          bed.extent_east_m, bed.extent_north_m);
  const double points = bed.extent_east_m / bed.cell_m * (bed.extent_north_m / bed.cell_m);
  require(points <= max_grid_points, "seafloor.cell_m",
          "a seabed of {} x {} m in cells of {} m has {:.2g} points, expected at most "
          "{:.3g}: make the cells larger or the seabed smaller",
          bed.extent_east_m, bed.extent_north_m, bed.cell_m, points, max_grid_points);
  require(bed.ripples.rms_height_m == 0.0 || bed.cell_m <= bed.ripples.wavelength_m / 4.0,
          "seafloor.ripples.wavelength_m",
          "ripples of {} m need cells of {} m or less, and seafloor.cell_m is {}",
          bed.ripples.wavelength_m, bed.ripples.wavelength_m / 4.0, bed.cell_m);
}

void check_images(const OutputOptions& output, const Require& require) {
  require(output.png_bits == 8 || output.png_bits == 16, "output.png_bits",
          "'output.png_bits' is {}, expected 8 or 16", output.png_bits);

  std::string known_layers;
  std::size_t found = 0;
  BinLayers::for_each([&](std::string_view layer, auto) {
    known_layers += fmt::format("{}{}", known_layers.empty() ? "" : ", ", layer);
    found += std::ranges::count(output.encoding.layers, layer) > 0;
  });
  require(found == output.encoding.layers.size(), "output.layers",
          "'output.layers' names a layer twice or one that does not exist, expected "
          "names of {}",
          known_layers);

  for (const auto& [key, names] : {std::pair("output.class_names", &output.class_names),
                                   std::pair("output.sediment_names", &output.sediment_names)})
    for (const std::string& name : *names) {
      require(std::ranges::count(*names, name) == 1, key,
              "'{}' names \"{}\" twice, expected each once", key, name);
      require(name != name_of_number_0, key,
              "'{}' names \"{}\", which is the name of number 0: leave it out", key, name);
    }
}

void check_beam(const Sonar& sonar, double sound_speed_mps, const Require& require) {
  const auto key = [&](std::string_view name) { return sonar_key(sonar, name); };
  const double high_rad = sonar.sector_end_rad();
  require(sonar.sector_low_rad < high_rad, key("sector_high_deg"),
          "'{}' is {:.6g}, expected more than sector_low_deg, which is {:.6g}",
          key("sector_high_deg"), high_rad / degree, sonar.sector_low_rad / degree);
  require(high_rad - sonar.sector_low_rad < 180.0 * degree, key("sector_high_deg"),
          "'{}' is {:.6g}, expected less than 180 degrees above sector_low_deg, "
          "which is {:.6g}",
          key("sector_high_deg"), high_rad / degree, sonar.sector_low_rad / degree);
  const double beamwidth_deg = sonar.vertical.beamwidth_rad / degree;
  require(beamwidth_deg == 0.0 || beamwidth_deg > narrowest_vertical_deg * (1.0 - 1e-9),
          key("vertical_beamwidth_deg"),
          "'{}' is {:.6g}, expected 0 (the same in all directions) or at least {}: a "
          "narrower beam is finer than the simulator's table of directions",
          key("vertical_beamwidth_deg"), beamwidth_deg, narrowest_vertical_deg);
  require(sonar.steers() || sonar.beams <= max_parallel_beams, key("beams"),
          "'{}' is {}, expected at most {} parallel beams of a sidescan", key("beams"), sonar.beams,
          max_parallel_beams);
  require(sonar.planes % 2 == 0, key("planes"), "'{}' is {}, expected an even number",
          key("planes"), sonar.planes);
  const double wavelength_m = sound_speed_mps / sonar.frequency_hz;
  const auto long_enough = [&](double length_m, std::string_view name) {
    require(length_m >= wavelength_m, key(name),
            "'{}' is {}, expected a wavelength or more, {:.4g} m at {} Hz", key(name), length_m,
            wavelength_m, sonar.frequency_hz);
  };
  long_enough(sonar.array_length_m, "array_length_m");
  long_enough(sonar.receive_length_m(), "receive_array_length_m");
  check_shading(sonar, require);
}

void check_pulse(const Sonar& sonar, double sound_speed_mps, const Require& require) {
  const auto key = [&](std::string_view name) { return sonar_key(sonar, name); };
  require(sonar.pulse.bandwidth_hz <= sonar.frequency_hz, key("bandwidth_hz"),
          "'{}' is {}, expected at most frequency_hz, which is {}", key("bandwidth_hz"),
          sonar.pulse.bandwidth_hz, sonar.frequency_hz);
  require(sonar.pulse.kind == PulseKind::cw ||
              sonar.pulse.transmitted_length_s() * sonar.pulse.bandwidth_hz >= 1.0 - 1e-9,
          key("pulse_length_s"),
          "'{}' is {}, shorter than a sweep can be with {}, which is {}; expected at least "
          "{:.3g} s",
          key("pulse_length_s"), sonar.pulse.length_s, key("bandwidth_hz"),
          sonar.pulse.bandwidth_hz, 1.0 / sonar.pulse.bandwidth_hz);
  const Sonar sampled = sonar.sampled(sound_speed_mps);
  const std::string bins_key = key(sonar.sample_rate_hz > 0.0 ? "sample_rate_hz" : "bins");
  require(sampled.bins <= max_bins, bins_key, "'{}' is {}: {} bins over {} m, expected at most {}",
          bins_key, sonar.sample_rate_hz, sampled.bins, sonar.range_m, max_bins);
  require(sampled.bin_m() <= sonar.range_m, bins_key,
          "'{}' is {} and makes bins of {:.3g} m, longer than range_m, which is {}; expected at "
          "least {:.3g} Hz",
          bins_key, sonar.sample_rate_hz, sampled.bin_m(), sonar.range_m,
          0.5 * sound_speed_mps / sonar.range_m);
  const std::string pulse_key =
      key(sonar.pulse.kind == PulseKind::cw && sonar.pulse.length_s > 0.0 ? "pulse_length_s"
                                                                          : "bandwidth_hz");
  const double pulse_m = sonar.pulse.cell_m(sound_speed_mps);
  const double reach_m = 0.5 * sound_speed_mps * (sonar.pulse.end_s() - sonar.pulse.begin_s());
  require(reach_m <= max_bins_in_pulse * sampled.bin_m(), bins_key,
          "'{}' makes bins of {:.3g} m, and a pulse of {:.3g} m with its side lobes spans more "
          "than {} of them; expected longer bins or a shorter pulse ({})",
          bins_key, sampled.bin_m(), reach_m, max_bins_in_pulse, pulse_key);
  require(pulse_m <= sonar.range_m, pulse_key,
          "'{}' makes a pulse of {:.3g} m, longer than range_m, which is {}", pulse_key, pulse_m,
          sonar.range_m);
}

void check_rays(const Sonar& sonar, double sound_speed_mps, const Require& require) {
  const double planes = sonar.fan_planes(sound_speed_mps / sonar.frequency_hz);
  require(planes * sonar.elevations <= max_rays, sonar_key(sonar, "elevations"),
          "{:.0f} planes of {} elevations are {:.2g} rays, expected at most {:.0e}", planes,
          sonar.elevations, planes * sonar.elevations, max_rays);
}

/// The kind of the sonar's preset, and what only a sidescan has.
void check_kind(const Scene& scene, const Sonar& sonar, const Require& require) {
  if (!sonar.preset.empty())
    require(sonar.kind == preset_sonar(sonar.preset).kind, sonar_key(sonar, "kind"),
            "'{}' is {}, but the preset {} is of another kind: leave the kind out",
            sonar_key(sonar, "kind"), sonar.steers() ? "imaging" : "sidescan", sonar.preset);
  if (!sonar.steers()) return;
  const auto refuse = [&](bool given, std::string_view key, std::string_view why) {
    require(!given, key, "'{}' cannot be used with sonar {}, whose kind is imaging: {}", key,
            sonar.name, why);
  };
  constexpr std::string_view sides_only = "these files hold the sides of a sidescan";
  refuse(scene.output.xtf, "output.xtf", sides_only);
  refuse(scene.output.jsf, "output.jsf", sides_only);
  refuse(scene.display.slant_range_correction, "display.slant_range_correction",
         "its beams look ahead, not to the sides");
  refuse(scene.display.speed_correction, "display.speed_correction", "its rows are beams");
}

void check_artefacts(const Scene& scene, const Require& require) {
  const double farthest_m =
      std::ranges::max(scene.sonars, {}, [](const Sonar& sonar) { return sonar.range_m; }).range_m;
  require(
      scene.artefacts.interference_range_m < farthest_m, "artefacts.interference_range_m",
      "'artefacts.interference_range_m' is {}, expected less than the range of a sonar, of which "
      "the longest is {} m",
      scene.artefacts.interference_range_m, farthest_m);
}

void check_recordings(const Scene& scene, const Require& require) {
  const std::size_t max_sonars = scene.output.xtf ? max_sonars_of_xtf : max_sonars_of_jsf;
  require(!scene.output.one_recording || scene.sonars.size() <= max_sonars, "output.one_recording",
          "'output.one_recording' puts {} sonars into one file, and {} holds {}: leave it "
          "out for a file each",
          scene.sonars.size(), scene.output.xtf ? "an XTF" : "a JSF", max_sonars);
  require(scene.output.start_time.empty() || unix_time(scene.output.start_time),
          "output.start_time",
          "'output.start_time' is {}, expected a time as \"2025-06-01T12:00:00Z\"",
          toml_string(scene.output.start_time));
}

}  // namespace

void check_scene(const Scene& scene,
                 const std::function<std::string(std::string_view key)>& place) {
  const Require require(place);
  check_bed_files(scene, require);
  check_objects(scene, require);
  check_materials(scene, require);
  check_sea(scene, require);
  if (scene.seafloor.kind == SeafloorKind::fractal) check_fractal(scene.seafloor, require);
  check_seabed(scene, require);
  check_images(scene.output, require);
  const double sound_speed_mps =
      scene.sea.sound_speed_mps.value_or(scatter::sound_speed_mps(scene.sea.water, 0.0));
  for (const Sonar& sonar : scene.sonars) {
    check_kind(scene, sonar, require);
    check_beam(sonar, sound_speed_mps, require);
    check_pulse(sonar, sound_speed_mps, require);
    check_rays(sonar, sound_speed_mps, require);
  }
  check_track(scene, require);
  check_artefacts(scene, require);
  check_recordings(scene, require);
  if (scene.track.kind == TrackKind::line)
    check_pings(scene, scene.track.pings, place("track.pings"));
}

void require_sidescans(const Scene& scene, std::string_view what) {
  for (const Sonar& sonar : scene.sonars)
    if (sonar.kind != SonarKind::sidescan)
      throw SceneError(fmt::format("'sonar.{}.kind' is \"imaging\", but {} can have sidescans only",
                                   sonar.name, what));
}

void check_pings(const Scene& scene, double pings, std::string_view place) {
  double pixels = 0.0;
  for (const Sonar& sonar : scene.sonars)
    pixels += static_cast<double>(sonar.sectors().size()) * sonar.bins * sonar.beams * pings;
  if (!(pixels <= max_pixels && pings <= max_pings))
    throw SceneError(fmt::format(
        "{}: {:.0f} pings make {:.2g} pixels, expected at most {:.0e}: use fewer pings or bins",
        place, pings, pixels, max_pixels));
}

}  // namespace ensonify::engine
