#include <ensonify/engine/scene/check.h>

#include <fmt/format.h>

#include <ensonify/engine/scene/schema.h>
#include <ensonify/engine/scene/seabed_check.h>

namespace ensonify::engine {
namespace {

constexpr double most_grid_points = 1e8;  // 0.8 GB of heights, ten times that while they are made
constexpr double most_pixels = 1e9;       // 60 GB of layers
constexpr double most_rays = 1e8;         // a side of a ping
constexpr double most_bins_in_pulse = 1000;

}  // namespace

void check_scene(const Scene& scene,
                 const std::function<std::string(std::string_view key)>& place) {
  const auto require = [&](bool holds, std::string_view key, const auto& message) {
    if (!holds) throw SceneError(fmt::format("{}: {}", place(key), message()));
  };

  const SeafloorOptions& bed = scene.seafloor;
  const auto file_of_kind = [&](SeafloorKind kind, std::string_view name, const InputFile& file) {
    const std::string key = fmt::format("seafloor.{}", name);
    require(bed.kind != kind || !file.name.empty(), "seafloor.kind", [&] {
      return fmt::format("'seafloor.kind' is \"{0}\", but no {0} is named: give its file as {1}",
                         name, key);
    });
    require(bed.kind == kind || file.name.empty(), key,
            [&] { return fmt::format("'{}' needs seafloor.kind = \"{}\"", key, name); });
  };
  file_of_kind(SeafloorKind::survey, "survey", bed.survey);
  file_of_kind(SeafloorKind::mesh, "mesh", bed.mesh);
  for (std::size_t i = 0; i < scene.objects.size(); ++i) {
    const std::string object = fmt::format("objects.{}", i);
    require(!scene.objects[i].mesh.name.empty(), object, [&] {
      return fmt::format("'{}' has no mesh: give its file as mesh = \"...\"", object);
    });
    require(!scene.objects[i].class_name.empty(), object + ".class",
            [&] { return fmt::format("'{}.class' is empty, expected a name", object); });
  }
  const auto material = [&](const std::string& name, const std::string& key) {
    try {
      for (const Sonar& sonar : scene.sonars)
        backscatter_of(material_named(name, scene.materials), sonar.frequency_hz, 1500.0, 0.0);
    } catch (const std::invalid_argument& error) {
      throw SceneError(fmt::format("{}: '{}': {}", place(key), key, error.what()));
    }
  };
  material(bed.material, "seafloor.material");
  for (std::size_t i = 0; i < scene.objects.size(); ++i)
    material(scene.objects[i].material, fmt::format("objects.{}.material", i));
  for (const Material& own : scene.materials)
    material(own.name, fmt::format("material.{}.like", own.name));
  require(scene.sea.profile.name.empty() || !scene.sea.sound_speed_mps, "sea.sound_speed_mps", [] {
    return "'sea.sound_speed_mps' and 'sea.profile' are both given, expected one of them";
  });
  if (bed.kind == SeafloorKind::fractal) {
    require(bed.cell_m <= bed.extent_east_m && bed.cell_m <= bed.extent_north_m, "seafloor.cell_m",
            [&] {
              return fmt::format("'seafloor.cell_m' is {}, longer than the seabed of {} x {} m",
                                 bed.cell_m, bed.extent_east_m, bed.extent_north_m);
            });
    const double points = bed.extent_east_m / bed.cell_m * (bed.extent_north_m / bed.cell_m);
    require(points <= most_grid_points, "seafloor.cell_m", [&] {
      return fmt::format(
          "a seabed of {} x {} m in cells of {} m has {:.2g} points, expected at most "
          "{:.0e}: make the cells larger or the seabed smaller",
          bed.extent_east_m, bed.extent_north_m, bed.cell_m, points, most_grid_points);
    });
    require(bed.ripples.rms_height_m == 0.0 || bed.cell_m <= bed.ripples.wavelength_m / 4.0,
            "seafloor.ripples.wavelength_m", [&] {
              return fmt::format(
                  "ripples of {} m need cells of {} m or less, and seafloor.cell_m is {}",
                  bed.ripples.wavelength_m, bed.ripples.wavelength_m / 4.0, bed.cell_m);
            });
  }

  check_seabed(scene, place);

  const double sound_speed_mps =
      scene.sea.sound_speed_mps.value_or(scatter::sound_speed_mps(scene.sea.water, 0.0));
  double pixels = 0.0;
  for (const Sonar& sonar : scene.sonars) {
    const auto key = [&](std::string_view name) {
      return fmt::format("sonar.{}.{}", sonar.name, name);
    };
    require(sonar.sector_low_rad < sonar.sector_high_rad, key("sector_high_deg"), [&] {
      return fmt::format("'{}' is {:.6g}, expected more than sector_low_deg, which is {:.6g}",
                         key("sector_high_deg"), sonar.sector_high_rad / radians_per_degree,
                         sonar.sector_low_rad / radians_per_degree);
    });
    require(sonar.sector_high_rad - sonar.sector_low_rad < 180.0 * radians_per_degree,
            key("sector_high_deg"), [&] {
              return fmt::format(
                  "'{}' is {:.6g}, expected less than 180 degrees above sector_low_deg, "
                  "which is {:.6g}",
                  key("sector_high_deg"), sonar.sector_high_rad / radians_per_degree,
                  sonar.sector_low_rad / radians_per_degree);
            });
    require(sonar.planes % 2 == 0, key("planes"), [&] {
      return fmt::format("'{}' is {}, expected an even number", key("planes"), sonar.planes);
    });
    const double wavelength_m = sound_speed_mps / sonar.frequency_hz;
    require(sonar.array_length_m >= wavelength_m, key("array_length_m"), [&] {
      return fmt::format("'{}' is {}, expected a wavelength or more, {:.4g} m at {} Hz",
                         key("array_length_m"), sonar.array_length_m, wavelength_m,
                         sonar.frequency_hz);
    });
    require(sonar.bandwidth_hz <= sonar.frequency_hz, key("bandwidth_hz"), [&] {
      return fmt::format("'{}' is {}, expected at most frequency_hz, which is {}",
                         key("bandwidth_hz"), sonar.bandwidth_hz, sonar.frequency_hz);
    });
    const double pulse_m = 0.5 * sound_speed_mps / sonar.bandwidth_hz;
    require(pulse_m <= most_bins_in_pulse * sonar.bin_m(), key("bins"), [&] {
      return fmt::format(
          "'{}' is {}: bins of {:.3g} m, and a pulse of {:.3g} m spans more than {} of "
          "them; expected fewer bins or more bandwidth_hz",
          key("bins"), sonar.bins, sonar.bin_m(), pulse_m, most_bins_in_pulse);
    });
    require(pulse_m <= sonar.range_m, key("bandwidth_hz"), [&] {
      return fmt::format("'{}' is {}: a pulse of {:.3g} m, longer than range_m, which is {}",
                         key("bandwidth_hz"), sonar.bandwidth_hz, pulse_m, sonar.range_m);
    });
    require(double(sonar.planes) * sonar.elevations <= most_rays, key("elevations"), [&] {
      return fmt::format("{} planes of {} elevations are {:.2g} rays, expected at most {:.0e}",
                         sonar.planes, sonar.elevations, double(sonar.planes) * sonar.elevations,
                         most_rays);
    });
    pixels += 2.0 * sonar.bins * scene.track.pings;
  }
  require(pixels <= most_pixels, "track.pings", [&] {
    return fmt::format(
        "{} pings make {:.2g} pixels, expected at most {:.0e}: take fewer pings or bins",
        scene.track.pings, pixels, most_pixels);
  });
}

}  // namespace ensonify::engine
