#include <ensonify/engine/scene/checks/unused_keys.h>

#include <algorithm>
#include <string_view>
#include <type_traits>
#include <utility>

#include <fmt/format.h>

#include <ensonify/engine/scene/keys/key_text.h>
#include <ensonify/engine/scene/keys/schema.h>
#include <ensonify/engine/seafloor/objects/shapes.h>

namespace ensonify::engine {
namespace {

/// Keys of a table, and whether they have no effect.
struct Rule {
  std::vector<std::string> keys;  ///< their names in the owner's table
  bool unused;
  std::string_view why;  ///< the text after "has no effect"
};

std::vector<Rule> scene_rules(const Scene& s) {
  return {
      {{"sea.temperature_c"},
       !s.sea.profile.empty(),
       "with 'sea.profile', from whose sound speeds temperatures follow"},
      {{"sea.volume_scattering_db", "sea.volume_scatterers_per_m3"},
       !s.arrivals.volume,
       "without 'arrivals.volume'"},
      {{"sea.volume_scatterers_per_m3"}, !s.speckle, "without 'speckle'"},

      {{"seafloor.extent_east_m", "seafloor.extent_north_m", "seafloor.cell_m", "seafloor.depth_m",
        "seafloor.slope_deg", "seafloor.downhill_deg", "seafloor.fractal.height_at_1m_m",
        "seafloor.fractal.hurst", "seafloor.fractal.spectrum", "seafloor.fractal.longest_m",
        "seafloor.fractal.sediments_own"},
       s.seafloor.kind != SeafloorKind::fractal,
       "on a seabed that is not generated"},
      {{"seafloor.downhill_deg"},
       s.seafloor.kind == SeafloorKind::fractal && s.seafloor.slope_rad == 0.0,
       "without 'seafloor.slope_deg'"},
      {{"seafloor.survey_cell_m", "seafloor.uncertainty_scatter", "seafloor.detail.cell_m",
        "seafloor.detail.height_at_1m_m", "seafloor.detail.hurst"},
       s.seafloor.kind != SeafloorKind::survey,
       "on a seabed that is not a survey"},
      {{"seafloor.detail.height_at_1m_m", "seafloor.detail.hurst"},
       s.seafloor.kind == SeafloorKind::survey && s.seafloor.detail.cell_m == 0.0,
       "without 'seafloor.detail.cell_m'"},
      {{"seafloor.water_level_m"},
       s.seafloor.kind == SeafloorKind::fractal,
       "on a seabed that is generated"},
      {{"seafloor.weld_m"},
       s.seafloor.kind != SeafloorKind::mesh,
       "on a seabed that is not a mesh"},
      {{"seafloor.material", "seafloor.water_level_m"},
       s.seafloor.kind == SeafloorKind::progressive,
       "on a seabed that was analysed, which has its own"},
      {{"seafloor.ripples.wavelength_m", "seafloor.ripples.across_crests_deg",
        "seafloor.ripples.relative_width", "seafloor.ripples.hurst"},
       s.seafloor.ripples.rms_height_m == 0.0,
       "without 'seafloor.ripples.rms_height_m'"},

      {{"track.pings"},
       s.track.kind != TrackKind::line,
       "on a track that is not a line: it has all pings that fit"},
      {{"track.legs", "track.leg_length_m", "track.leg_spacing_m", "track.turn_radius_m",
        "track.ping_in_turns"},
       s.track.kind != TrackKind::lawn_mower,
       "on a track that is not a lawn-mower"},
      {{"track.speed_mps", "track.heading_deg"},
       s.track.kind == TrackKind::file,
       "on a track from a file"},
      {{"track.smooth_s"}, s.track.kind != TrackKind::file, "on a track that is not from a file"},
      {{"track.follow_s", "track.climb_mps"},
       s.track.kind != TrackKind::file && s.track.vertical == Vertical::depth,
       "without 'track.vertical = \"altitude\"'"},

      {{"arrivals.bottom_loss_db"}, !s.arrivals.multiples, "without 'arrivals.multiples'"},
      {{"arrivals.wall_loss_db"}, !s.arrivals.double_bounce, "without 'arrivals.double_bounce'"},

      {{"artefacts.stale_s"},
       s.artefacts.stale_navigation == 0.0,
       "without 'artefacts.stale_navigation'"},
      {{"artefacts.interference_range_m", "artefacts.interference_drift_m",
        "artefacts.interference_length_m"},
       !s.artefacts.interference_db,
       "without 'artefacts.interference_db'"},
      {{"artefacts.gain_step_s"},
       s.artefacts.gain_step_db == 0.0,
       "without 'artefacts.gain_step_db'"},
      {{"artefacts.automatic_gain_m"},
       s.artefacts.automatic_gain == 0.0,
       "without 'artefacts.automatic_gain'"},
      {{"artefacts.fish_strength_db", "artefacts.fish_length_m", "artefacts.fish_height_m"},
       s.artefacts.fish_per_hectare == 0.0,
       "without 'artefacts.fish_per_hectare'"},
      {{"artefacts.wake_heading_deg", "artefacts.wake_width_m", "artefacts.wake_offset_m"},
       !s.artefacts.wake_db,
       "without 'artefacts.wake_db'"},
      {{"artefacts.shimmer_m", "artefacts.shimmer_s"},
       s.artefacts.shimmer_db == 0.0,
       "without 'artefacts.shimmer_db'"},

      {{"display.speed_correction"},
       s.track.kind != TrackKind::file && s.track.speed_mps == 0.0,
       "without 'track.speed_mps'"},
      {{"display.column_value"},
       !s.display.speed_correction,
       "without 'display.speed_correction', because a column shows one sample"},
      {{"display.gain_db"},
       s.display.mapping == Mapping::equalised,
       "with 'display.mapping = \"equalised\"', where the order of levels decides"},
      {{"display.gamma"},
       s.display.mapping != Mapping::gamma,
       "without 'display.mapping = \"gamma\"'"},
      {{"display.range_db"},
       s.display.mapping != Mapping::logarithmic,
       "without 'display.mapping = \"logarithmic\"'"},
      {{"output.exr_compression"}, !s.output.exr, "without 'output.exr'"},
      {{"output.layers"}, !s.output.exr && !s.output.npz, "without 'output.exr' or 'output.npz'"},
      {{"output.one_recording"},
       !s.output.xtf && !s.output.jsf,
       "without 'output.xtf' or 'output.jsf'"},
  };
}

/// Rules for the vehicle's random movements.
std::vector<Rule> motion_rules(const Scene& s) {
  std::vector<Rule> rules;
  for (const auto& [name, of] : {std::pair{"roll", &s.motion.roll},
                                 {"pitch", &s.motion.pitch},
                                 {"heading", &s.motion.heading},
                                 {"heave", &s.motion.heave},
                                 {"sway", &s.motion.sway},
                                 {"surge", &s.motion.surge},
                                 {"speed", &s.motion.speed}}) {
    rules.push_back({{fmt::format("motion.{}.period_s", name)},
                     of->rms == 0.0,
                     "without an rms of that table"});
    rules.push_back({{fmt::format("motion.{}.wander_s", name)},
                     of->wander_rms == 0.0,
                     "without a wander of that table"});
  }
  return rules;
}

bool has_side_lobes(ShadingKind kind) {
  return kind == ShadingKind::taylor || kind == ShadingKind::chebyshev;
}

std::vector<Rule> sonar_rules(const Sonar& s) {
  return {
      {{"window"}, s.pulse.kind == PulseKind::cw, "with pulse = \"cw\""},
      {{"bandwidth_hz"},
       s.pulse.kind == PulseKind::cw && s.pulse.length_s > 0.0,
       "with pulse = \"cw\" and 'pulse_length_s', whose bandwidth is 1 / pulse_length_s: give one of "
       "the two"},
      {{"shading_side_lobe_db"},
       !has_side_lobes(s.shading) && !has_side_lobes(s.receive_shading),
       "with a shading that is neither taylor nor chebyshev"},
      {{"taylor_nbar"},
       s.shading != ShadingKind::taylor && s.receive_shading != ShadingKind::taylor,
       "with a shading that is not taylor"},
      {{"beam_spacing_m"}, s.beams == 1, "with one beam"},
      {{"vertical_ripple_period_deg", "vertical_ripple_dark_deg"},
       s.vertical.ripple_db == 0.0,
       "without vertical_ripple_db"},
      {{"self_noise_speed_mps", "self_noise_slope_db"},
       !s.receiver.self_noise_db,
       "without self_noise_db"},
      {{"output_noise_wander_db"}, !s.receiver.output_noise_db, "without output_noise_db"},
      {{"output_noise_wander_s"},
       s.receiver.output_noise_wander_db == 0.0,
       "without output_noise_wander_db"},
      {{"curve_range_db"},
       s.receiver.curve != TransferCurve::logarithmic,
       "without curve = \"logarithmic\""},
  };
}

std::vector<Rule> material_rules(const Material& m) {
  return {
      {{"lambert_mu_db"}, m.model != "lambert", "without model = \"lambert\""},
      {{"diffuse_db", "specular", "lobe_width_deg"},
       m.model != "solid",
       "without model = \"solid\""},
      {{"gsab_lambert_db", "gsab_lambert_exponent", "gsab_specular_db", "gsab_specular_width_deg",
        "gsab_transitional_db", "gsab_transitional_width_deg"},
       m.model != "gsab",
       "without model = \"gsab\""},
      {{"density_ratio", "loss", "volume", "exponent", "strength_cm4"},
       !is_sediment(m),
       "with a model that is not a sediment's"},
      // With other models, these keys choose the sediment whose texture is used.
      {{"mean_grain_size_phi", "sound_speed_ratio"}, m.model == "solid", "with model = \"solid\""},
  };
}

/// Rules for materials if the scene's ground has no texture.
std::vector<Rule> even_material_rules(const Material& m) {
  return {
      {{"texture_patch_m", "texture_shape", "texture_exponent", "glint_share", "glints_per_m2",
        "variation_db", "variation_m"},
       true,
       "without 'texture' and 'speckle'"},
      {{"mean_grain_size_phi", "sound_speed_ratio"},
       m.model == "lambert" || m.model == "gsab" || m.model == "table",
       "with a model that is not a sediment's, without 'texture' and 'speckle'"},
  };
}

std::vector<Rule> object_rules(const ObjectOptions& o) {
  return {
      {{"current_deg"},
       o.scour_ratio == 0.0 && o.tail_ratio == 0.0,
       "without scour_ratio or tail_ratio"},
      {{"burial_scale_m"}, o.burial_spread == 0.0, "without burial_spread"},
      {{"part_classes"},
       o.assembly.empty() && (o.shape.empty() || shape_named(o.shape).parts.empty()),
       "on an object without parts"},
  };
}

/// Rules for a patch or a layer of relief.
std::vector<Rule> area_rules(const Area& area) {
  return {
      {{"middle_east_m", "middle_north_m"}, area.radius_m == 0.0, "without radius_m"},
      {{"image_value"}, area.image.empty(), "without image"},
      {{"patch_m"}, area.share == 1.0, "with share = 1"},
      {{"ragged_m"},
       area.polygon_m.empty() && area.outline.empty() && area.radius_m == 0.0 && area.image.empty(),
       "without polygon_m, outline, radius_m or image"},
  };
}

/// Collects warnings about keys that the scene gives.
class UnusedKeys {
 public:
  explicit UnusedKeys(const Scene& scene) : scene_(scene) {}

  template <class Owner>
  void add(const Section<Owner>& section, const std::vector<Rule>& rules, const Owner& owner,
           std::string_view table) {
    for (const Rule& rule : rules)
      if (rule.unused)
        for (const std::string& key : rule.keys)
          add_key(section, key, owner, fmt::format("{}.{}", table, key), rule.why);
  }
  void add_of_scene(const std::vector<Rule>& rules) {
    for (const Rule& rule : rules)
      if (rule.unused)
        for (const std::string& name : rule.keys) {
          const std::size_t dot = name.rfind('.');
          add_key(*std::ranges::find(scene_sections(), name.substr(0, dot), &Section<Scene>::name),
                  name.substr(dot + 1), scene_, name, rule.why);
        }
  }

  std::vector<std::string> warnings;

 private:
  /// There is no warning for a default value, because dumped scenes contain all keys.
  template <class Owner>
  void add_key(const Section<Owner>& section, std::string_view key_name, const Owner& owner,
               const std::string& name, std::string_view why) {
    const Key<Owner>& key = *std::ranges::find(section.keys, key_name, &Key<Owner>::name);
    const auto given = scene_.places.find(name);
    if (given != scene_.places.end() && option_text(key, owner) != option_text(key, Owner{}))
      warnings.push_back(fmt::format("{}: '{}' has no effect {}", given->second, name, why));
  }

  const Scene& scene_;
};

}  // namespace

std::vector<std::string> unused_keys(const Scene& scene) {
  UnusedKeys unused(scene);
  unused.add_of_scene(scene_rules(scene));
  unused.add_of_scene(motion_rules(scene));
  for (const Sonar& sonar : scene.sonars)
    unused.add(sonar_section(), sonar_rules(sonar), sonar, fmt::format("sonar.{}", sonar.name));
  for (const Material& material : scene.materials) {
    const std::string table = fmt::format("material.{}", material.name);
    unused.add(material_section(), material_rules(material), material, table);
    if (!scene.texture || !scene.speckle)
      unused.add(material_section(), even_material_rules(material), material, table);
  }
  for_each_list(scene, [&](const auto& section, const auto& list) {
    for (std::size_t i = 0; i < list.size(); ++i) {
      const std::string table = fmt::format("{}.{}", section.name, i);
      if constexpr (std::is_same_v<std::decay_t<decltype(list[i])>, ObjectOptions>)
        unused.add(section, object_rules(list[i]), list[i], table);
      else
        unused.add(section, area_rules(list[i].area), list[i], table);
    }
  });
  return std::move(unused.warnings);
}

}  // namespace ensonify::engine
