#include <ensonify/engine/scene/checks/unused_keys.h>

#include <algorithm>
#include <functional>
#include <string_view>
#include <type_traits>

#include <fmt/format.h>

#include <ensonify/engine/scene/keys/key_text.h>
#include <ensonify/engine/scene/keys/schema.h>
#include <ensonify/engine/seafloor/objects/shapes.h>

namespace ensonify::engine {
namespace {

/// Keys of a table that have no effect for some owners.
template <class Owner>
struct Rule {
  std::vector<std::string> keys;  ///< their names in the owner's table
  std::function<bool(const Owner&)> unused;
  std::string_view why;  ///< the text after "has no effect"
};

std::vector<Rule<Scene>> scene_rules() {
  using S = const Scene&;
  return {
      {{"sea.temperature_c"},
       [](S s) { return !s.sea.profile.empty(); },
       "with 'sea.profile', from whose sound speeds temperatures follow"},
      {{"sea.volume_scattering_db", "sea.volume_scatterers_per_m3"},
       [](S s) { return !s.arrivals.volume; },
       "without 'arrivals.volume'"},
      {{"sea.volume_scatterers_per_m3"}, [](S s) { return !s.speckle; }, "without 'speckle'"},

      {{"seafloor.extent_east_m", "seafloor.extent_north_m", "seafloor.cell_m", "seafloor.depth_m",
        "seafloor.slope_deg", "seafloor.downhill_deg", "seafloor.fractal.height_at_1m_m",
        "seafloor.fractal.hurst", "seafloor.fractal.spectrum", "seafloor.fractal.longest_m",
        "seafloor.fractal.sediments_own"},
       [](S s) { return s.seafloor.kind != SeafloorKind::fractal; },
       "on a seabed that is not generated"},
      {{"seafloor.downhill_deg"},
       [](S s) { return s.seafloor.kind == SeafloorKind::fractal && s.seafloor.slope_rad == 0.0; },
       "without 'seafloor.slope_deg'"},
      {{"seafloor.survey_cell_m", "seafloor.uncertainty_scatter", "seafloor.detail.cell_m",
        "seafloor.detail.height_at_1m_m", "seafloor.detail.hurst"},
       [](S s) { return s.seafloor.kind != SeafloorKind::survey; },
       "on a seabed that is not a survey"},
      {{"seafloor.detail.height_at_1m_m", "seafloor.detail.hurst"},
       [](S s) {
         return s.seafloor.kind == SeafloorKind::survey && s.seafloor.detail.cell_m == 0.0;
       },
       "without 'seafloor.detail.cell_m'"},
      {{"seafloor.water_level_m"},
       [](S s) { return s.seafloor.kind == SeafloorKind::fractal; },
       "on a seabed that is generated"},
      {{"seafloor.weld_m"},
       [](S s) { return s.seafloor.kind != SeafloorKind::mesh; },
       "on a seabed that is not a mesh"},
      {{"seafloor.material", "seafloor.water_level_m"},
       [](S s) { return s.seafloor.kind == SeafloorKind::progressive; },
       "on a seabed that was analysed, which has its own"},
      {{"seafloor.ripples.wavelength_m", "seafloor.ripples.across_crests_deg",
        "seafloor.ripples.relative_width", "seafloor.ripples.hurst"},
       [](S s) { return s.seafloor.ripples.rms_height_m == 0.0; },
       "without 'seafloor.ripples.rms_height_m'"},

      {{"track.pings"},
       [](S s) { return s.track.kind != TrackKind::line; },
       "on a track that is not a line: it has all pings that fit"},
      {{"track.legs", "track.leg_length_m", "track.leg_spacing_m", "track.turn_radius_m",
        "track.ping_in_turns"},
       [](S s) { return s.track.kind != TrackKind::lawn_mower; },
       "on a track that is not a lawn-mower"},
      {{"track.speed_mps", "track.heading_deg"},
       [](S s) { return s.track.kind == TrackKind::file; },
       "on a track from a file"},
      {{"track.smooth_s"},
       [](S s) { return s.track.kind != TrackKind::file; },
       "on a track that is not from a file"},
      {{"track.follow_s", "track.climb_mps"},
       [](S s) { return s.track.kind != TrackKind::file && s.track.vertical == Vertical::depth; },
       "without 'track.vertical = \"altitude\"'"},

      {{"arrivals.bottom_loss_db"},
       [](S s) { return !s.arrivals.multiples; },
       "without 'arrivals.multiples'"},
      {{"arrivals.wall_loss_db"},
       [](S s) { return !s.arrivals.double_bounce; },
       "without 'arrivals.double_bounce'"},

      {{"artefacts.stale_s"},
       [](S s) { return s.artefacts.stale_navigation == 0.0; },
       "without 'artefacts.stale_navigation'"},
      {{"artefacts.interference_range_m", "artefacts.interference_drift_m",
        "artefacts.interference_length_m"},
       [](S s) { return !s.artefacts.interference_db; },
       "without 'artefacts.interference_db'"},
      {{"artefacts.gain_step_s"},
       [](S s) { return s.artefacts.gain_step_db == 0.0; },
       "without 'artefacts.gain_step_db'"},
      {{"artefacts.automatic_gain_m"},
       [](S s) { return s.artefacts.automatic_gain == 0.0; },
       "without 'artefacts.automatic_gain'"},
      {{"artefacts.fish_strength_db", "artefacts.fish_length_m", "artefacts.fish_height_m"},
       [](S s) { return s.artefacts.fish_per_hectare == 0.0; },
       "without 'artefacts.fish_per_hectare'"},
      {{"artefacts.wake_heading_deg", "artefacts.wake_width_m", "artefacts.wake_offset_m"},
       [](S s) { return !s.artefacts.wake_db; },
       "without 'artefacts.wake_db'"},
      {{"artefacts.shimmer_m", "artefacts.shimmer_s"},
       [](S s) { return s.artefacts.shimmer_db == 0.0; },
       "without 'artefacts.shimmer_db'"},

      {{"display.speed_correction"},
       [](S s) { return s.track.kind != TrackKind::file && s.track.speed_mps == 0.0; },
       "without 'track.speed_mps'"},
      {{"display.column_value"},
       [](S s) { return !s.display.speed_correction; },
       "without 'display.speed_correction', because a column shows one sample"},
      {{"display.gain_db"},
       [](S s) { return s.display.mapping == Mapping::equalised; },
       "with 'display.mapping = \"equalised\"', where the order of levels decides"},
      {{"display.gamma"},
       [](S s) { return s.display.mapping != Mapping::gamma; },
       "without 'display.mapping = \"gamma\"'"},
      {{"display.range_db"},
       [](S s) { return s.display.mapping != Mapping::logarithmic; },
       "without 'display.mapping = \"logarithmic\"'"},
      {{"output.exr_compression"}, [](S s) { return !s.output.exr; }, "without 'output.exr'"},
      {{"output.layers"},
       [](S s) { return !s.output.exr && !s.output.npz; },
       "without 'output.exr' or 'output.npz'"},
      {{"output.one_recording"},
       [](S s) { return !s.output.xtf && !s.output.jsf; },
       "without 'output.xtf' or 'output.jsf'"},
  };
}

/// Rules for the vehicle's random movements.
std::vector<Rule<Scene>> motion_rules() {
  struct Table {
    std::string_view name;
    Oscillation MotionOptions::*of;
  };
  std::vector<Rule<Scene>> rules;
  for (const Table table : {Table{"roll", &MotionOptions::roll},
                            {"pitch", &MotionOptions::pitch},
                            {"heading", &MotionOptions::heading},
                            {"heave", &MotionOptions::heave},
                            {"sway", &MotionOptions::sway},
                            {"surge", &MotionOptions::surge},
                            {"speed", &MotionOptions::speed}}) {
    rules.push_back({{fmt::format("motion.{}.period_s", table.name)},
                     [of = table.of](const Scene& s) { return (s.motion.*of).rms == 0.0; },
                     "without an rms of that table"});
    rules.push_back({{fmt::format("motion.{}.wander_s", table.name)},
                     [of = table.of](const Scene& s) { return (s.motion.*of).wander_rms == 0.0; },
                     "without a wander of that table"});
  }
  return rules;
}

std::vector<Rule<Sonar>> sonar_rules() {
  using S = const Sonar&;
  return {
      {{"window"}, [](S s) { return s.pulse.kind == PulseKind::cw; }, "with pulse = \"cw\""},
      {{"bandwidth_hz"},
       [](S s) { return s.pulse.kind == PulseKind::cw && s.pulse.length_s > 0.0; },
       "with pulse = \"cw\" and 'pulse_length_s', whose bandwidth is 1 / pulse_length_s: give one of "
       "the two"},
      {{"shading_side_lobe_db"},
       [](S s) {
         const auto has = [](ShadingKind kind) {
           return kind == ShadingKind::taylor || kind == ShadingKind::chebyshev;
         };
         return !has(s.shading) && !has(s.receive_shading);
       },
       "with a shading that is neither taylor nor chebyshev"},
      {{"taylor_nbar"},
       [](S s) {
         return s.shading != ShadingKind::taylor && s.receive_shading != ShadingKind::taylor;
       },
       "with a shading that is not taylor"},
      {{"beam_spacing_m"}, [](S s) { return s.beams == 1; }, "with one beam"},
      {{"vertical_ripple_period_deg", "vertical_ripple_dark_deg"},
       [](S s) { return s.vertical.ripple_db == 0.0; },
       "without vertical_ripple_db"},
      {{"self_noise_speed_mps", "self_noise_slope_db"},
       [](S s) { return !s.receiver.self_noise_db; },
       "without self_noise_db"},
      {{"output_noise_wander_db"},
       [](S s) { return !s.receiver.output_noise_db; },
       "without output_noise_db"},
      {{"output_noise_wander_s"},
       [](S s) { return s.receiver.output_noise_wander_db == 0.0; },
       "without output_noise_wander_db"},
      {{"curve_range_db"},
       [](S s) { return s.receiver.curve != TransferCurve::logarithmic; },
       "without curve = \"logarithmic\""},
  };
}

std::vector<Rule<Material>> material_rules() {
  using M = const Material&;
  return {
      {{"lambert_mu_db"}, [](M m) { return m.model != "lambert"; }, "without model = \"lambert\""},
      {{"diffuse_db", "specular", "lobe_width_deg"},
       [](M m) { return m.model != "solid"; },
       "without model = \"solid\""},
      {{"gsab_lambert_db", "gsab_lambert_exponent", "gsab_specular_db", "gsab_specular_width_deg",
        "gsab_transitional_db", "gsab_transitional_width_deg"},
       [](M m) { return m.model != "gsab"; },
       "without model = \"gsab\""},
      {{"density_ratio", "loss", "volume", "exponent", "strength_cm4"},
       [](M m) { return !is_sediment(m); },
       "with a model that is not a sediment's"},
      // With other models, these keys choose the sediment whose texture is used.
      {{"mean_grain_size_phi", "sound_speed_ratio"},
       [](M m) { return m.model == "solid"; },
       "with model = \"solid\""},
  };
}

/// Rules for materials if the scene's ground has no texture.
std::vector<Rule<Material>> even_material_rules() {
  using M = const Material&;
  return {
      {{"texture_patch_m", "texture_shape", "texture_exponent", "glint_share", "glints_per_m2",
        "variation_db", "variation_m"},
       [](M) { return true; },
       "without 'texture' and 'speckle'"},
      {{"mean_grain_size_phi", "sound_speed_ratio"},
       [](M m) { return m.model == "lambert" || m.model == "gsab" || m.model == "table"; },
       "with a model that is not a sediment's, without 'texture' and 'speckle'"},
  };
}

std::vector<Rule<ObjectOptions>> object_rules() {
  using O = const ObjectOptions&;
  return {
      {{"current_deg"},
       [](O o) { return o.scour_ratio == 0.0 && o.tail_ratio == 0.0; },
       "without scour_ratio or tail_ratio"},
      {{"burial_scale_m"}, [](O o) { return o.burial_spread == 0.0; }, "without burial_spread"},
      {{"part_classes"},
       [](O o) {
         return o.assembly.empty() && (o.shape.empty() || shape_named(o.shape).parts.empty());
       },
       "on an object without parts"},
  };
}

/// Rules for a patch or a layer of relief.
template <class Layer>
std::vector<Rule<Layer>> area_rules() {
  using L = const Layer&;
  return {
      {{"middle_east_m", "middle_north_m"},
       [](L l) { return l.area.radius_m == 0.0; },
       "without radius_m"},
      {{"image_value"}, [](L l) { return l.area.image.empty(); }, "without image"},
      {{"patch_m"}, [](L l) { return l.area.share == 1.0; }, "with share = 1"},
      {{"ragged_m"},
       [](L l) {
         return l.area.polygon_m.empty() && l.area.outline.empty() && l.area.radius_m == 0.0 &&
                l.area.image.empty();
       },
       "without polygon_m, outline, radius_m or image"},
  };
}

/// Collects warnings about keys that the scene gives.
class UnusedKeys {
 public:
  explicit UnusedKeys(const Scene& scene) : scene_(scene) {}

  template <class Owner>
  void add(const Section<Owner>& section, const std::vector<Rule<Owner>>& rules, const Owner& owner,
           std::string_view table) {
    for (const Rule<Owner>& rule : rules)
      if (rule.unused(owner))
        for (const std::string& key : rule.keys)
          add_key(*std::ranges::find(section.keys, key, &Key<Owner>::name), owner,
                  fmt::format("{}.{}", table, key), rule.why);
  }
  void add_of_scene(const std::vector<Rule<Scene>>& rules) {
    for (const Rule<Scene>& rule : rules)
      if (rule.unused(scene_))
        for (const std::string& name : rule.keys) {
          const std::size_t dot = name.rfind('.');
          const auto& section =
              *std::ranges::find(scene_sections(), name.substr(0, dot), &Section<Scene>::name);
          add_key(*std::ranges::find(section.keys, name.substr(dot + 1), &Key<Scene>::name), scene_,
                  name, rule.why);
        }
  }

  std::vector<std::string> warnings;

 private:
  /// There is no warning for a default value, because dumped scenes contain all keys.
  template <class Owner>
  void add_key(const Key<Owner>& key, const Owner& owner, const std::string& name,
               std::string_view why) {
    const auto given = scene_.places.find(name);
    if (given != scene_.places.end() && option_text(key, owner) != option_text(key, Owner{}))
      warnings.push_back(fmt::format("{}: '{}' has no effect {}", given->second, name, why));
  }

  const Scene& scene_;
};

}  // namespace

std::vector<std::string> unused_keys(const Scene& scene) {
  UnusedKeys unused(scene);
  unused.add_of_scene(scene_rules());
  unused.add_of_scene(motion_rules());
  for (const Sonar& sonar : scene.sonars)
    unused.add(sonar_section(), sonar_rules(), sonar, fmt::format("sonar.{}", sonar.name));
  for (const Material& material : scene.materials) {
    const std::string table = fmt::format("material.{}", material.name);
    unused.add(material_section(), material_rules(), material, table);
    if (!scene.texture || !scene.speckle)
      unused.add(material_section(), even_material_rules(), material, table);
  }
  for_each_list(scene, [&](const auto& section, const auto& list) {
    for (std::size_t i = 0; i < list.size(); ++i) {
      const std::string table = fmt::format("{}.{}", section.name, i);
      if constexpr (std::is_same_v<std::decay_t<decltype(list[i])>, ObjectOptions>)
        unused.add(section, object_rules(), list[i], table);
      else
        unused.add(section, area_rules<std::decay_t<decltype(list[i])>>(), list[i], table);
    }
  });
  return std::move(unused.warnings);
}

}  // namespace ensonify::engine
