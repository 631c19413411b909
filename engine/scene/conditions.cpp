#include <ensonify/engine/scene/conditions.h>

#include <algorithm>

#include <ensonify/engine/base/units.h>

namespace ensonify::engine {
namespace {

// The motion of a towed or small autonomous vehicle. The rms movements with the period of waves are
// typical of a slight sea. The slow movements, by steering and depth keeping, are those of two
// recordings (bench/realism). The vehicles of the recordings turn by 1.0 and 1.1 degrees per second
// (rms), this one by 0.4: a towfish for long ranges must turn less, or an echo that arrives after
// 0.2 s would be outside its beam.
MotionOptions survey_motion() {
  MotionOptions motion;
  motion.crab_rad = 11.0 * degree;  // the medians of the recordings are 7 and 15
  motion.roll = {.rms = 0.8 * degree, .period_s = 5.0, .wander_rms = 0.7 * degree, .wander_s = 6.0};
  motion.pitch = {
      .rms = 0.4 * degree, .period_s = 5.0, .wander_rms = 1.0 * degree, .wander_s = 6.0};
  motion.heading = {
      .rms = 0.5 * degree, .period_s = 9.0, .wander_rms = 2.0 * degree, .wander_s = 8.0};
  motion.heave = {.rms = 0.05, .period_s = 5.0, .wander_rms = 0.5, .wander_s = 10.0};
  return motion;
}

// Recordings show: levels that are 2 to 6 dB below full scale at 30 % of the range and fall by 7 to
// 9 dB up to its end; a mean amplitude of 0.25 to 0.45 of full scale; noise after the gain that is
// 25 to 35 dB below the bed and changes by 2.5 to 5.5 dB (rms) along the line; and a contrast near
// that of the largest of three looks.
void use_survey_recorder(ReceiverOptions& receiver) {
  receiver.spreading = 30.0;
  receiver.bed_level_db = -9.5;
  receiver.output_noise_db = -39.5;
  receiver.output_noise_wander_db = 3.5;
  receiver.looks = 3;
  receiver.detector = Detector::peak;
}

// The levels of two recordings ripple over the angle (bench/realism/ripple.py): by 3.4 and 2.8 dB
// on the sides of one, by 0.4 and 0.9 dB on the sides of the other. These are bands along the track
// that follow the altitude. An echo has the ripple of the beam twice. A measured beam already has
// its ripple.
void use_survey_beam(VerticalPattern& vertical) {
  if (!vertical.file.empty()) return;
  vertical.ripple_db = 1.0;
  vertical.ripple_dark_rad = 36.0 * degree;
}

// Turbid coastal water at some hundred kilohertz. Both numbers were chosen by the water columns of
// two recordings (bench/realism). Both water columns have single bright points. In one of them,
// near the sonar, the levels fit about this number of scatterers per m^3.
void use_survey_water(Scene& scene) {
  scene.arrivals.volume = true;
  scene.sea.state.volume_scattering_db = -55.0;
  scene.sea.state.volume_scatterers_per_m3 = 40.0;
}

}  // namespace

void use_conditions(Scene& scene) {
  const bool has_preset = std::ranges::any_of(scene.sonars, [](const Sonar& sonar) {
    return !sonar.preset.empty() && sonar.kind == SonarKind::sidescan;
  });
  if (scene.conditions == Conditions::survey ||
      (scene.conditions == Conditions::by_preset && has_preset)) {
    // a file has its own motion
    if (scene.track.kind != TrackKind::file) scene.motion = survey_motion();
    scene.arrivals.surface = true;
    use_survey_water(scene);
    scene.arrivals.burst_m = 0.12;  // in two recordings, the first 0.2 m are bright
    for (Sonar& sonar : scene.sonars) {
      if (sonar.steers()) continue;  // the recordings are of sidescans
      use_survey_recorder(sonar.receiver);
      use_survey_beam(sonar.vertical);
    }
    // On displays at sea, beds get darker with range. For a bed by Lambert's law, a gain of 50
    // would make all ranges equally bright.
    scene.display.spreading = 30.0;
    scene.display.track_smoothing_px = 0.45;  // as with interpolated rows
  } else if (scene.conditions == Conditions::ideal) {
    scene.texture = false;
  }
}

}  // namespace ensonify::engine
