#include <ensonify/engine/scene/checks/check.h>

#include <algorithm>
#include <initializer_list>
#include <string_view>
#include <type_traits>
#include <utility>

#include <fmt/format.h>

#include <ensonify/engine/scene/keys/key_text.h>
#include <ensonify/engine/scene/keys/schema.h>
#include <ensonify/engine/seafloor/objects/shapes.h>

namespace ensonify::engine {
namespace {

// rule(keys, unused, why) is called for keys of a table, by their names in the table. If they are
// unused, those that the scene gives get a warning; `why` follows "has no effect".

void scene_rules(const Scene& s, const auto& rule) {
  rule({"sea.temperature_c"}, !s.sea.profile.empty(),
       "with 'sea.profile', from whose sound speeds temperatures follow");
  rule({"sea.volume_scattering_db", "sea.volume_scatterers_per_m3"}, !s.arrivals.volume,
       "without 'arrivals.volume'");
  rule({"sea.volume_scatterers_per_m3"}, !s.speckle, "without 'speckle'");

  rule({"seafloor.extent_east_m", "seafloor.extent_north_m", "seafloor.cell_m", "seafloor.depth_m",
        "seafloor.slope_deg", "seafloor.downhill_deg", "seafloor.fractal.height_at_1m_m",
        "seafloor.fractal.hurst", "seafloor.fractal.spectrum", "seafloor.fractal.longest_m",
        "seafloor.fractal.sediments_own"},
       s.seafloor.kind != SeafloorKind::fractal, "on a seabed that is not generated");
  rule({"seafloor.downhill_deg"},
       s.seafloor.kind == SeafloorKind::fractal && s.seafloor.slope_rad == 0.0,
       "without 'seafloor.slope_deg'");
  rule({"seafloor.survey_cell_m", "seafloor.uncertainty_scatter", "seafloor.detail.cell_m",
        "seafloor.detail.height_at_1m_m", "seafloor.detail.hurst"},
       s.seafloor.kind != SeafloorKind::survey, "on a seabed that is not a survey");
  rule({"seafloor.detail.height_at_1m_m", "seafloor.detail.hurst"},
       s.seafloor.kind == SeafloorKind::survey && s.seafloor.detail.cell_m == 0.0,
       "without 'seafloor.detail.cell_m'");
  rule({"seafloor.water_level_m"}, s.seafloor.kind == SeafloorKind::fractal,
       "on a seabed that is generated");
  rule({"seafloor.weld_m"}, s.seafloor.kind != SeafloorKind::mesh,
       "on a seabed that is not a mesh");
  rule({"seafloor.material", "seafloor.water_level_m"},
       s.seafloor.kind == SeafloorKind::progressive,
       "on a seabed that was analysed, which has its own");
  rule({"seafloor.ripples.wavelength_m", "seafloor.ripples.across_crests_deg",
        "seafloor.ripples.relative_width", "seafloor.ripples.hurst"},
       s.seafloor.ripples.rms_height_m == 0.0, "without 'seafloor.ripples.rms_height_m'");

  rule({"track.pings"}, s.track.kind != TrackKind::line,
       "on a track that is not a line: it has all pings that fit");
  rule({"track.legs", "track.leg_length_m", "track.leg_spacing_m", "track.turn_radius_m",
        "track.ping_in_turns"},
       s.track.kind != TrackKind::lawn_mower, "on a track that is not a lawn-mower");
  rule({"track.speed_mps", "track.heading_deg"}, s.track.kind == TrackKind::file,
       "on a track from a file");
  rule({"track.smooth_s"}, s.track.kind != TrackKind::file, "on a track that is not from a file");
  rule({"track.follow_s", "track.climb_mps"},
       s.track.kind != TrackKind::file && s.track.vertical == Vertical::depth,
       "without 'track.vertical = \"altitude\"'");

  rule({"arrivals.bottom_loss_db"}, !s.arrivals.multiples, "without 'arrivals.multiples'");
  rule({"arrivals.wall_loss_db"}, !s.arrivals.double_bounce, "without 'arrivals.double_bounce'");

  rule({"artefacts.stale_s"}, s.artefacts.stale_navigation == 0.0,
       "without 'artefacts.stale_navigation'");
  rule({"artefacts.interference_range_m", "artefacts.interference_drift_m",
        "artefacts.interference_length_m"},
       !s.artefacts.interference_db, "without 'artefacts.interference_db'");
  rule({"artefacts.gain_step_s"}, s.artefacts.gain_step_db == 0.0,
       "without 'artefacts.gain_step_db'");
  rule({"artefacts.automatic_gain_m"}, s.artefacts.automatic_gain == 0.0,
       "without 'artefacts.automatic_gain'");
  rule({"artefacts.fish_strength_db", "artefacts.fish_length_m", "artefacts.fish_height_m"},
       s.artefacts.fish_per_hectare == 0.0, "without 'artefacts.fish_per_hectare'");
  rule({"artefacts.wake_heading_deg", "artefacts.wake_width_m", "artefacts.wake_offset_m"},
       !s.artefacts.wake_db, "without 'artefacts.wake_db'");
  rule({"artefacts.shimmer_m", "artefacts.shimmer_s"}, s.artefacts.shimmer_db == 0.0,
       "without 'artefacts.shimmer_db'");

  rule({"display.speed_correction"}, s.track.kind != TrackKind::file && s.track.speed_mps == 0.0,
       "without 'track.speed_mps'");
  rule({"display.column_value"}, !s.display.speed_correction,
       "without 'display.speed_correction', because a column shows one sample");
  rule({"display.gain_db"}, s.display.mapping == Mapping::equalised,
       "with 'display.mapping = \"equalised\"', where the order of levels decides");
  rule({"display.gamma"}, s.display.mapping != Mapping::gamma,
       "without 'display.mapping = \"gamma\"'");
  rule({"display.range_db"}, s.display.mapping != Mapping::logarithmic,
       "without 'display.mapping = \"logarithmic\"'");
  rule({"output.exr_compression"}, !s.output.exr, "without 'output.exr'");
  rule({"output.layers"}, !s.output.exr && !s.output.npz, "without 'output.exr' or 'output.npz'");
  rule({"output.one_recording"}, !s.output.xtf && !s.output.jsf,
       "without 'output.xtf' or 'output.jsf'");
}

/// Rules for the vehicle's random movements.
void motion_rules(const Scene& s, const auto& rule) {
  for (const auto& [name, of] : {std::pair{"roll", &s.motion.roll},
                                 {"pitch", &s.motion.pitch},
                                 {"heading", &s.motion.heading},
                                 {"heave", &s.motion.heave},
                                 {"sway", &s.motion.sway},
                                 {"surge", &s.motion.surge},
                                 {"speed", &s.motion.speed}}) {
    rule({fmt::format("motion.{}.period_s", name)}, of->rms == 0.0, "without an rms of that table");
    rule({fmt::format("motion.{}.wander_s", name)}, of->wander_rms == 0.0,
         "without a wander of that table");
  }
}

bool has_side_lobes(ShadingKind kind) {
  return kind == ShadingKind::taylor || kind == ShadingKind::chebyshev;
}

void sonar_rules(const Sonar& s, const auto& rule) {
  rule({"window"}, s.pulse.kind == PulseKind::cw, "with pulse = \"cw\"");
  rule(
      {"bandwidth_hz"}, s.pulse.kind == PulseKind::cw && s.pulse.length_s > 0.0,
      "with pulse = \"cw\" and 'pulse_length_s', whose bandwidth is 1 / pulse_length_s: give one of "
      "the two");
  rule({"shading_side_lobe_db"}, !has_side_lobes(s.shading) && !has_side_lobes(s.receive_shading),
       "with a shading that is neither taylor nor chebyshev");
  rule({"taylor_nbar"},
       s.shading != ShadingKind::taylor && s.receive_shading != ShadingKind::taylor,
       "with a shading that is not taylor");
  rule({"beam_spacing_m"}, !s.steers() && s.beams == 1, "with one beam");
  rule({"beam_spacing_m", "sides", "port_mount_deg", "starboard_mount_deg"}, s.steers(),
       "with kind = \"imaging\"");
  rule({"field_of_view_deg", "beam_steps", "transmit_beamwidth_deg"}, !s.steers(),
       "with kind = \"sidescan\"");
  rule({"vertical_ripple_period_deg", "vertical_ripple_dark_deg"}, s.vertical.ripple_db == 0.0,
       "without vertical_ripple_db");
  rule({"self_noise_speed_mps", "self_noise_slope_db"}, !s.receiver.self_noise_db,
       "without self_noise_db");
  rule({"output_noise_wander_db"}, !s.receiver.output_noise_db, "without output_noise_db");
  rule({"output_noise_wander_s"}, s.receiver.output_noise_wander_db == 0.0,
       "without output_noise_wander_db");
  rule({"curve_range_db"}, s.receiver.curve != TransferCurve::logarithmic,
       "without curve = \"logarithmic\"");
}

void material_rules(const Material& m, const auto& rule) {
  rule({"lambert_mu_db"}, m.model != "lambert", "without model = \"lambert\"");
  rule({"diffuse_db", "specular", "lobe_width_deg"}, m.model != "solid",
       "without model = \"solid\"");
  rule({"gsab_lambert_db", "gsab_lambert_exponent", "gsab_specular_db", "gsab_specular_width_deg",
        "gsab_transitional_db", "gsab_transitional_width_deg"},
       m.model != "gsab", "without model = \"gsab\"");
  rule({"density_ratio", "loss", "volume", "exponent", "strength_cm4"}, !is_sediment(m),
       "with a model that is not a sediment's");
  // With other models, these keys choose the sediment whose texture is used.
  rule({"mean_grain_size_phi", "sound_speed_ratio"}, m.model == "solid", "with model = \"solid\"");
}

/// Rules for materials if the scene's ground has no texture.
void even_material_rules(const Material& m, const auto& rule) {
  rule({"texture_patch_m", "texture_shape", "texture_exponent", "glint_share", "glints_per_m2",
        "variation_db", "variation_m"},
       true, "without 'texture' and 'speckle'");
  rule({"mean_grain_size_phi", "sound_speed_ratio"},
       m.model == "lambert" || m.model == "gsab" || m.model == "table",
       "with a model that is not a sediment's, without 'texture' and 'speckle'");
}

void object_rules(const ObjectOptions& o, const auto& rule) {
  rule({"current_deg"}, o.scour_ratio == 0.0 && o.tail_ratio == 0.0,
       "without scour_ratio or tail_ratio");
  rule({"burial_scale_m"}, o.burial_spread == 0.0, "without burial_spread");
  rule({"part_classes"},
       o.assembly.empty() && (o.shape.empty() || shape_named(o.shape).parts.empty()),
       "on an object without parts");
}

/// Rules for a patch or a layer of relief.
void area_rules(const Area& area, const auto& rule) {
  rule({"middle_east_m", "middle_north_m"}, area.radius_m == 0.0, "without radius_m");
  rule({"image_value"}, area.image.empty(), "without image");
  rule({"patch_m"}, area.share == 1.0, "with share = 1");
  rule({"ragged_m"},
       area.polygon_m.empty() && area.outline.empty() && area.radius_m == 0.0 && area.image.empty(),
       "without polygon_m, outline, radius_m or image");
}

/// Collects warnings about keys that the scene gives.
class UnusedKeys {
 public:
  explicit UnusedKeys(const Scene& scene) : scene_(scene) {}

  /// rule(keys, unused, why) for the keys of a table.
  template <class Owner>
  auto rule_of(const Section<Owner>& section, const Owner& owner, std::string_view table) {
    return [=, this, &section, &owner](std::initializer_list<std::string_view> keys, bool unused,
                                       std::string_view why) {
      if (!unused) return;
      for (const std::string_view key : keys)
        add(section, key, owner, fmt::format("{}.{}", table, key), why);
    };
  }
  /// The same for keys of the scene's tables, by their whole names.
  auto rule_of_scene() {
    return [this](std::initializer_list<std::string_view> keys, bool unused, std::string_view why) {
      if (!unused) return;
      for (const std::string_view name : keys) {
        const std::size_t dot = name.rfind('.');
        add(*std::ranges::find(scene_sections(), name.substr(0, dot), &Section<Scene>::name),
            name.substr(dot + 1), scene_, std::string(name), why);
      }
    };
  }

  std::vector<std::string> warnings;

 private:
  /// There is no warning for a default value, because dumped scenes contain all keys.
  template <class Owner>
  void add(const Section<Owner>& section, std::string_view key_name, const Owner& owner,
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
  scene_rules(scene, unused.rule_of_scene());
  motion_rules(scene, unused.rule_of_scene());
  for (const Sonar& sonar : scene.sonars)
    sonar_rules(sonar, unused.rule_of(sonar_section(), sonar, "sonar." + sonar.name));
  for (const Material& material : scene.materials) {
    const std::string table = "material." + material.name;
    const auto rule = unused.rule_of(material_section(), material, table);
    material_rules(material, rule);
    if (!scene.texture || !scene.speckle) even_material_rules(material, rule);
  }
  for_each_list(scene, [&](const auto& section, const auto& list) {
    for (std::size_t i = 0; i < list.size(); ++i) {
      const std::string table = fmt::format("{}.{}", section.name, i);
      const auto rule = unused.rule_of(section, list[i], table);
      if constexpr (std::is_same_v<std::decay_t<decltype(list[i])>, ObjectOptions>)
        object_rules(list[i], rule);
      else
        area_rules(list[i].area, rule);
    }
  });
  return std::move(unused.warnings);
}

}  // namespace ensonify::engine
