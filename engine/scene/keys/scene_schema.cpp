#include <ensonify/engine/scene/keys/schema.h>

#include <fmt/format.h>

#include <ensonify/engine/base/made_once.h>
#include <ensonify/engine/scene/output_formats.h>
#include <ensonify/engine/seafloor/material.h>
#include <ensonify/engine/trace/face_source.h>
#include <ensonify/engine/trace/intersector.h>

namespace ensonify::engine {
namespace {

std::vector<std::string_view> surface_choices() {
  std::vector<std::string_view> names = face_source_names();
  names.insert(names.begin(), auto_surface);
  return names;
}

/// The keys of the movement of one degree of freedom.
std::vector<Key<Scene>> oscillation(Oscillation MotionOptions::*which, std::string_view rms,
                                    std::string_view wander, std::string_view unit,
                                    double largest) {
  const auto option = [&](double Oscillation::*member) {
    return at(&Scene::motion, which, member);
  };
  return {{rms, unit, {0, largest}, "Rms of the part driven by waves.", option(&Oscillation::rms)},
          {"period_s", "s", {0.01, 3600}, "Its mean period.", option(&Oscillation::period_s)},
          {wander, unit, {0, largest}, "Rms of slow wandering.", option(&Oscillation::wander_rms)},
          {"wander_s", "s", {0.01, 1e6}, "Its correlation time.", option(&Oscillation::wander_s)}};
}
Section<Scene> angle(std::string_view name, std::string_view help,
                     Oscillation MotionOptions::*which) {
  return {name, help, oscillation(which, "rms_deg", "wander_deg", "degrees", 45)};
}
Section<Scene> shift(std::string_view name, std::string_view help,
                     Oscillation MotionOptions::*which) {
  return {name, help, oscillation(which, "rms_m", "wander_m", "m", 1000)};
}

// clang-format off
/// The keys of [output]: one key for each format, then the others.
std::vector<Key<Scene>> output_keys() {
  std::vector<Key<Scene>> keys;
  for (const OutputFormat& format : output_formats())
    keys.push_back({format.name, "", {}, format.help, at(&Scene::output, format.wanted)});
  const std::vector<Key<Scene>> others = {
      {"exr_compression", "", {},
       "How EXR compresses, always without loss. zip and piz take three to five times as long as "
       "rle, and a third less space.",
       at(&Scene::output, &OutputOptions::encoding, &LayerEncoding::exr_compression),
       {"none", "rle", "zip", "piz"}},
      {"layers", "", {}, "The layers that EXR and NPZ have, such as [\"intensity\", \"region\"]; "
       "unset: all.",
       at(&Scene::output, &OutputOptions::encoding, &LayerEncoding::layers)},
      {"pings_per_file", "", {0, 1e9},
       "Pings of each part of a run. A run in parts has the files of each part in a folder, "
       "part_0001/NAME_0001.exr and so on, and continues after a stop. 0: one part, or for images "
       "of more than 1 GiB parts of about 64 MiB.",
       at(&Scene::output, &OutputOptions::pings_per_file)},
      {"file_per_leg", "", {},
       "A part for each leg of a lawn-mower and the turn after it; legs of more than pings_per_file "
       "pings have several.",
       at(&Scene::output, &OutputOptions::file_per_leg)},
      {"one_recording", "", {},
       "All sonars in one recording, recording.xtf and recording.jsf, instead of NAME.xtf and "
       "NAME.jsf for each. XTF holds three sonars.",
       at(&Scene::output, &OutputOptions::one_recording)},
      {"png_bits", "", {8, 16}, "Bits per channel of NAME.png.",
       at(&Scene::output, &OutputOptions::png_bits), {}, "8 or 16"},
      {"truth", "", {}, "The truth drawn over the image, with a legend, as NAME_truth.png.",
       at(&Scene::output, &OutputOptions::truth)},
      {"fans", "", {},
       "Each ping of an imaging sonar as seen from above, to scale, as NAME_fan_PING.png.",
       at(&Scene::output, &OutputOptions::fans)},
      {"class_names", "", {},
       "Names of the classes 1, 2, ... in the layer class, whether the scene has them or not; its "
       "other classes follow. Runs with the same names have the same numbers. This holds for the "
       "files of a run, for datasets and for images() in Python. A session (stream, live, Simulator) "
       "has the seafloor's own numbers, and a list of their names.",
       at(&Scene::output, &OutputOptions::class_names)},
      {"sediment_names", "", {}, "The same for materials in the layer sediment.",
       at(&Scene::output, &OutputOptions::sediment_names)},
      {"start_time", "", {},
       "Time of t_s = 0 in the recordings; unset: 2000-01-01, or the "
       "track's own time if it counts from 1970.",
       at(&Scene::output, &OutputOptions::start_time), {}, "a time, \"2025-06-01T12:00:00Z\""},
  };
  keys.insert(keys.end(), others.begin(), others.end());
  return keys;
}

std::string bed_material_help() {
  return fmt::format(
      "What it is made of: a sediment (`ensonify sediments` lists them), a cover ({}), a solid (as "
      "for objects.material) or a [material.NAME].",
      cover_names());
}

std::vector<Section<Scene>> made_scene_sections() {
  using scatter::SeaWater;
  return {
      {"",
       "The whole run.",
       {
           {"conditions", "", {},
            "Chooses the values of keys that the scene does not give. survey: a vehicle that moves, "
            "echoes of the water and of its surface, transmit leakage, a recorder with noise, "
            "three looks and samples that clip, and a display on which beds get darker with range. "
            "ideal: none of these, and even ground (texture = false), for exact levels. auto: "
            "survey if a sidescan has a preset; otherwise ideal, but with texture.",
            at(&Scene::conditions), {"auto", "ideal", "survey"}},
           {"seed", "", {0, largest_seed}, "Seed of all random numbers.", at(&Scene::seed)},
           {"speckle", "", {},
            "Whether echoes and noise fluctuate, as interference makes them; false: their means.",
            at(&Scene::speckle)},
           {"texture", "", {},
            "Whether the ground scatters unevenly below the sonar's cell, by the materials' "
            "texture, glint and variation keys; in the same way in each pass. It needs speckle = "
            "true.",
            at(&Scene::texture)},
       }},
      {"sea",
       "The water: its temperature, salinity and acidity, or plain numbers for speed and "
       "absorption.",
       {
           {"temperature_c", "degrees Celsius", {-2, 40},
            "Temperature; with a profile it follows from the profile's sound speeds.",
            at(&Scene::sea, &Sea::water, &SeaWater::temperature_c)},
           {"salinity_psu", "psu", {0, 45}, "Salinity.",
            at(&Scene::sea, &Sea::water, &SeaWater::salinity_psu)},
           {"ph", "", {6, 9}, "Acidity; it matters to absorption below some kilohertz.",
            at(&Scene::sea, &Sea::water, &SeaWater::ph)},
           {"profile", "", {},
            "A cast: CSV with columns depth_m and soundspeed_mps, or a CastAway's file. The sound "
            "speed is its mean down to the bed; absorption follows from the temperatures at which "
            "water of salinity_psu has the cast's speeds. A path as for seafloor.survey.",
            at(&Scene::sea, &Sea::profile)},
           {"refraction", "", {},
            "off: rays are straight, at the profile's mean speed; time-only: rays are straight, "
            "but travel times follow the profile; full: rays are bent by the profile. Ranges "
            "of bins are travel times, converted by the mean speed.",
            at(&Scene::sea, &Sea::refraction), {"off", "time-only", "full"}},
           {"sound_speed_mps", "m/s", {1000, 2000},
            "Sound speed; unset: from the profile, or the water at half the bed's depth.",
            at(&Scene::sea, &Sea::sound_speed_mps)},
           {"absorption_db_per_km", "dB/km", {0, 10000},
            "Absorption; unset: from the profile, or the water at half the bed's depth.",
            at(&Scene::sea, &Sea::absorption_db_per_km)},
           {"wind_mps", "m/s", {0, 60}, "Wind speed, for noise and surface echoes.",
            at(&Scene::sea, &Sea::state, &SeaState::wind_mps)},
           {"shipping", "", {0, 1}, "Ships' noise, from 0 (no traffic) to 1 (heavy traffic).",
            at(&Scene::sea, &Sea::state, &SeaState::shipping)},
           {"volume_scattering_db", "dB re 1/m", {-200, 0},
            "Backscattering strength of the water itself, for arrivals.volume.",
            at(&Scene::sea, &Sea::state, &SeaState::volume_scattering_db)},
           {"volume_scatterers_per_m3", "per m^3", {0, 1e9},
            "How many scatterers (bubbles, plankton, grains) make up arrivals.volume: with few of "
            "them, the water near the sonar has single bright points, if speckle = true; 0: very "
            "many.",
            at(&Scene::sea, &Sea::state, &SeaState::volume_scatterers_per_m3)},
       }},
      {"seafloor",
       "Where the seabed comes from and what it is made of.",
       {
           {"kind", "", {},
            "A generated seabed, a survey's grid, a mesh, or a progressive mesh that `ensonify "
            "analyse` made of one of them.",
            at(&Scene::seafloor, &SeafloorOptions::kind),
            {"fractal", "survey", "mesh", "progressive"}},
           {"seed", "", {0, largest_seed},
            "Seed of the seabed and of the objects on it; unset: the scene's seed.",
            at(&Scene::seafloor_seed)},
           {"extent_east_m", "m", {0.01, 100e3},
            "Size of a generated seabed from west to east, rounded to whole cells.",
            at(&Scene::seafloor, &SeafloorOptions::extent_east_m)},
           {"extent_north_m", "m", {0.01, 100e3},
            "Size of a generated seabed from south to north, rounded to whole cells.",
            at(&Scene::seafloor, &SeafloorOptions::extent_north_m)},
           {"cell_m", "m", {0.001, 1000}, "Spacing of a generated seabed's grid.",
            at(&Scene::seafloor, &SeafloorOptions::cell_m)},
           {"depth_m", "m", {0.1, 11000}, "Mean depth of a generated seabed.",
            at(&Scene::seafloor, &SeafloorOptions::depth_m)},
           {"slope_deg", "degrees", {0, 45}, "Slope of a generated seabed without its relief.",
            at(&Scene::seafloor, &SeafloorOptions::slope_rad)},
           {"downhill_deg", "degrees", {-360, 360},
            "Heading down this slope, clockwise from north.",
            at(&Scene::seafloor, &SeafloorOptions::downhill_rad)},
           {"survey", "", {},
            "A survey's grid (GeoTIFF, BAG, ESRI ASCII, netCDF), an array of heights (.npy, rows "
            "from the south) or soundings (lines of x y z): a path under the scene's folder, or "
            "data:path under the data folder.",
            at(&Scene::seafloor, &SeafloorOptions::survey)},
           {"survey_cell_m", "m", {0, 1000},
            "Cell size of an .npy file, or of the grid that soundings are put on; 0: the file has "
            "its own.",
            at(&Scene::seafloor, &SeafloorOptions::survey_cell_m)},
           {"uncertainty_scatter", "", {0, 10},
            "Each height of a survey is moved at random by this share of its uncertainty (the band "
            "of that name), normally distributed; 0: the heights of the file.",
            at(&Scene::seafloor, &SeafloorOptions::uncertainty_scatter)},
           {"mesh", "", {},
            "A mesh (PLY, OBJ, STL, OFF) with z up as the whole seabed; a path as for survey.",
            at(&Scene::seafloor, &SeafloorOptions::mesh)},
           {"progressive", "", {},
            "A progressive mesh that `ensonify analyse` wrote: bed, objects and what they are made "
            "of; a path as for survey.",
            at(&Scene::seafloor, &SeafloorOptions::progressive)},
           {"weld_m", "m", {-1, 1000},
            "Vertices of the mesh this close are joined; 0: only equal ones; negative: none.",
            at(&Scene::seafloor, &SeafloorOptions::weld_tolerance_m)},
           {"water_level_m", "m", {-11000, 9000},
            "Height of the sea surface in the survey's or the mesh's own heights.",
            at(&Scene::seafloor, &SeafloorOptions::water_level_m)},
           {"material", "", {},
            made_once<bed_material_help>(),
            at(&Scene::seafloor, &SeafloorOptions::material)},
           {"penetration_m", "m", {0, 100},
            "Thickness of the bed's uppermost layer, where it is a sediment: sound enters it, and "
            "the scene's objects that are buried in it echo, weaker by the sediment's reflection "
            "and loss; 0: no sound enters.",
            at(&Scene::seafloor, &SeafloorOptions::penetration_m)},
       }},
      {"seafloor.fractal",
       "Relief of a generated seabed that looks the same at every scale.",
       {
           {"height_at_1m_m", "m", {0, 100},
            "Rms height difference of points 1 m apart, before longest_m reduces it; "
            "0: no fractal relief.",
            at(&Scene::seafloor, &SeafloorOptions::fractal, &FractalRelief::height_at_1m_m)},
           {"hurst", "", {0.01, 0.99}, "Hurst exponent: small is jagged, large is rolling.",
            at(&Scene::seafloor, &SeafloorOptions::fractal, &FractalRelief::hurst)},
           {"spectrum", "", {},
            "variogram: height differences grow as distance^hurst; paper: the smoother "
            "field of Riordan, Toal and others, whose spectrum has the exponent 4 hurst + 2.",
            at(&Scene::seafloor, &SeafloorOptions::fractal, &FractalRelief::spectrum),
            {"variogram", "paper"}},
           {"longest_m", "m", {0, 1e6},
            "Waves longer than this add no more height; 0: they do, up to the seabed's length.",
            at(&Scene::seafloor, &SeafloorOptions::fractal, &FractalRelief::longest_m)},
           {"sediments_own", "", {},
            "Whether this is the relief that the material's roughness parameters describe: its "
            "slopes are then not counted twice.",
            at(&Scene::seafloor, &SeafloorOptions::fractal, &FractalRelief::sediments_own)},
       }},
      {"seafloor.ripples",
       "Relief of a generated seabed with crests in one direction, added to the fractal one.",
       {
           {"rms_height_m", "m", {0, 10}, "Rms height; 0: no ripples.",
            at(&Scene::seafloor, &SeafloorOptions::ripples, &RippleRelief::rms_height_m)},
           {"wavelength_m", "m", {0.01, 1000}, "Distance from crest to crest; four cells or more.",
            at(&Scene::seafloor, &SeafloorOptions::ripples, &RippleRelief::wavelength_m)},
           {"across_crests_deg", "degrees", {-360, 360},
            "Heading of the direction across the crests, clockwise from north.",
            at(&Scene::seafloor, &SeafloorOptions::ripples, &RippleRelief::across_crests_rad)},
           {"relative_width", "", {0.01, 1},
            "Spectral half width over wavenumber: small is regular, large is broken up.",
            at(&Scene::seafloor, &SeafloorOptions::ripples, &RippleRelief::relative_width)},
           {"hurst", "", {0.01, 5},
            "How fast the spectrum falls off its maximum; beyond 1 the crests are smooth.",
            at(&Scene::seafloor, &SeafloorOptions::ripples, &RippleRelief::hurst)},
       }},
      {"seafloor.detail",
       "Relief of a survey finer than its cells: smoothly interpolated heights, and fractal relief "
       "that begins where their spectrum ends.",
       {
           {"cell_m", "m", {0, 1000}, "Spacing of the finer grid; 0: the survey unchanged.",
            at(&Scene::seafloor, &SeafloorOptions::detail, &SurveyDetail::cell_m)},
           {"height_at_1m_m", "m", {0, 100},
            "Rms height difference of points 1 m apart; unset: estimated from the survey's finest "
            "scales.",
            at(&Scene::seafloor, &SeafloorOptions::detail, &SurveyDetail::height_at_1m_m)},
           {"hurst", "", {0.01, 0.99},
            "Hurst exponent; unset: estimated from the survey's finest scales.",
            at(&Scene::seafloor, &SeafloorOptions::detail, &SurveyDetail::hurst)},
       }},
      {"track",
       "Where the vehicle goes. Its middle is relative to the middle of the seabed.",
       {
           {"kind", "", {}, "A straight line, a lawn-mower's legs, or a recorded track.",
            at(&Scene::track, &TrackOptions::kind), {"line", "lawn-mower", "file"}},
           {"pings", "", {1, 10e6},
            "Number of pings of a line; the other kinds have all pings that fit.",
            at(&Scene::track, &TrackOptions::pings)},
           {"speed_mps", "m/s", {0, 50}, "Speed over ground, of a line or a lawn-mower.",
            at(&Scene::track, &TrackOptions::speed_mps)},
           {"heading_deg", "degrees", {-360, 360},
            "Heading of the line or the first leg, clockwise from north.",
            at(&Scene::track, &TrackOptions::heading_rad)},
           {"middle_east_m", "m", {-1e6, 1e6},
            "The track's middle, east of the seabed's; a recorded track is moved by this distance.",
            at(&Scene::track, &TrackOptions::middle_east_m)},
           {"middle_north_m", "m", {-1e6, 1e6}, "The same to the north.",
            at(&Scene::track, &TrackOptions::middle_north_m)},
           {"vertical", "", {},
            "depth: constant depth, or the file's (z_m or depth_m); altitude: follows the bed, as "
            "a file with only altitude_m does.",
            at(&Scene::track, &TrackOptions::vertical), {"depth", "altitude"}},
           {"altitude_m", "m", {0.01, 11000},
            "Height over the mean seabed along the track, or over the bed that is followed; a "
            "file's altitude_m has precedence.",
            at(&Scene::track, &TrackOptions::altitude_m)},
           {"follow_s", "s", {0, 3600},
            "Time constant with which the bed is followed; 0: without delay.",
            at(&Scene::track, &TrackOptions::follow_s)},
           {"climb_mps", "m/s", {0, 100}, "Fastest climb and dive when the bed is followed.",
            at(&Scene::track, &TrackOptions::climb_mps)},
           {"ping_interval_s", "s", {0, 3600},
            "Time between pings, the same for all sonars; 0: the two-way time of the longest "
            "range, or, for a file, one ping per row.",
            at(&Scene::track, &TrackOptions::ping_interval_s)},
           {"legs", "", {1, 10000}, "A lawn-mower's legs.", at(&Scene::track, &TrackOptions::legs)},
           {"leg_length_m", "m", {0.01, 1e6}, "Length of each leg.",
            at(&Scene::track, &TrackOptions::leg_length_m)},
           {"leg_spacing_m", "m", {0.01, 1e6},
            "Distance between neighbouring legs; the second lies to starboard of the first.",
            at(&Scene::track, &TrackOptions::leg_spacing_m)},
           {"turn_radius_m", "m", {0, 1e6},
            "Radius of the turns; above half the spacing the vehicle swings out first. 0: half the "
            "spacing.",
            at(&Scene::track, &TrackOptions::turn_radius_m)},
           {"ping_in_turns", "", {},
            "Whether the turns are recorded; they take their time in any case.",
            at(&Scene::track, &TrackOptions::ping_in_turns)},
           {"file", "", {},
            "A recorded track: CSV with t_s (or time_s, utc_s), then x_m,y_m (local), "
            "easting_m,northing_m (the survey's) or lat_deg,lon_deg, and where known z_m, depth_m "
            "or altitude_m, roll_deg, pitch_deg, heading_deg; or an XTF or JSF recording, whose "
            "pings have these; a path as for seafloor.survey.",
            at(&Scene::track, &TrackOptions::file)},
           {"smooth_s", "s", {0, 60},
            "Time over which a file's positions and heights are smoothed, without repeated "
            "positions; 0: not smoothed.",
            at(&Scene::track, &TrackOptions::smooth_s)},
           {"origin_lat_deg", "degrees", {-90, 90},
            "Latitude of the seabed's middle, for a file with lat_deg and lon_deg, and for "
            "recordings; not used where the survey has a coordinate reference system. Unset: such "
            "that the track of such a file is in the middle of the seabed, else in the North "
            "Sea.",
            at(&Scene::track, &TrackOptions::origin_latitude_rad)},
           {"origin_lon_deg", "degrees", {-360, 360}, "Longitude of the seabed's middle.",
            at(&Scene::track, &TrackOptions::origin_longitude_rad)},
       }},
      {"motion",
       "How the vehicle moves about its track: a steady attitude, and one table per degree of "
       "freedom with movements driven by waves (rms and period_s) and slow wandering (wander and "
       "wander_s).",
       {
           {"roll_deg", "degrees", {-180, 180}, "Steady roll, starboard down.",
            at(&Scene::motion, &MotionOptions::roll_rad)},
           {"pitch_deg", "degrees", {-80, 80}, "Steady pitch, nose up.",
            at(&Scene::motion, &MotionOptions::pitch_rad)},
           {"crab_deg", "degrees", {-180, 180},
            "Steady angle of the heading to starboard of the course.",
            at(&Scene::motion, &MotionOptions::crab_rad)},
       }},
      angle("motion.roll", "Roll, starboard down.", &MotionOptions::roll),
      angle("motion.pitch", "Pitch, nose up.", &MotionOptions::pitch),
      angle("motion.heading", "Heading about the course.", &MotionOptions::heading),
      shift("motion.heave", "Up and down.", &MotionOptions::heave),
      shift("motion.sway", "To starboard and port of the track.", &MotionOptions::sway),
      shift("motion.surge", "Ahead and back along the track.", &MotionOptions::surge),
      {"motion.speed",
       "Change of the speed of a line or a lawn-mower.",
       oscillation(&MotionOptions::speed, "rms_mps", "wander_mps", "m/s", 20)},
      {"navigation",
       "How the pose that the vehicle reports (reported_* in NAME_pings.csv) differs from the true "
       "one: a bias drawn once per run, noise drawn for each message, and the step to which a "
       "message is rounded.",
       {
           {"position_bias_m", "m", {0, 10000}, "Rms bias to the east and to the north.",
            at(&Scene::navigation, &NavigationOptions::position, &ReportError::bias_rms)},
           {"position_rms_m", "m", {0, 10000}, "Rms noise to the east and to the north.",
            at(&Scene::navigation, &NavigationOptions::position, &ReportError::rms)},
           {"position_step_m", "m", {0, 10000}, "Step; 0: not rounded.",
            at(&Scene::navigation, &NavigationOptions::position, &ReportError::step)},
           {"height_bias_m", "m", {0, 10000}, "Rms bias of the height (the depth).",
            at(&Scene::navigation, &NavigationOptions::height, &ReportError::bias_rms)},
           {"height_rms_m", "m", {0, 10000}, "Its rms noise.",
            at(&Scene::navigation, &NavigationOptions::height, &ReportError::rms)},
           {"height_step_m", "m", {0, 10000}, "Its step; 0: not rounded.",
            at(&Scene::navigation, &NavigationOptions::height, &ReportError::step)},
           {"attitude_bias_deg", "degrees", {0, 45}, "Rms bias of roll and of pitch.",
            at(&Scene::navigation, &NavigationOptions::attitude, &ReportError::bias_rms)},
           {"attitude_rms_deg", "degrees", {0, 45}, "Their rms noise.",
            at(&Scene::navigation, &NavigationOptions::attitude, &ReportError::rms)},
           {"attitude_step_deg", "degrees", {0, 45}, "Their step; 0: not rounded.",
            at(&Scene::navigation, &NavigationOptions::attitude, &ReportError::step)},
           {"heading_bias_deg", "degrees", {0, 180}, "Rms bias of the heading.",
            at(&Scene::navigation, &NavigationOptions::heading, &ReportError::bias_rms)},
           {"heading_rms_deg", "degrees", {0, 180}, "Its rms noise.",
            at(&Scene::navigation, &NavigationOptions::heading, &ReportError::rms)},
           {"heading_step_deg", "degrees", {0, 180}, "Its step; 0: not rounded.",
            at(&Scene::navigation, &NavigationOptions::heading, &ReportError::step)},
           {"delay_s", "s", {0, 3600}, "Age of a message when a ping takes it.",
            at(&Scene::navigation, &NavigationOptions::delay_s)},
           {"update_interval_s", "s", {0, 3600},
            "Time between messages; pings between them repeat the last one. 0: one message per "
            "ping.",
            at(&Scene::navigation, &NavigationOptions::update_interval_s)},
       }},
      {"arrivals",
       "What is received in addition to the direct echo, each with its own switch. It is in "
       "intensity and sample, not in intensity_mean.",
       {
           {"surface", "", {},
            "The sea surface's return and its reverberation, by sea.wind_mps; waves move it up and "
            "down.",
            at(&Scene::arrivals, &OtherPathsOptions::surface)},
           {"volume", "", {}, "Reverberation of the water, by sea.volume_scattering_db.",
            at(&Scene::arrivals, &OtherPathsOptions::volume)},
           {"multiples", "", {},
            "Copies of the direct echo by way of the surface and the bubbles under it.",
            at(&Scene::arrivals, &OtherPathsOptions::multiples)},
           {"second_time_around", "", {},
            "Echoes of earlier pings that come from beyond the range, of a level bed of "
            "seafloor.material: a ping that was sent a time P earlier adds the echo from r + c P / 2 "
            "at r. P is track.ping_interval_s or a multiple of it, or of the two-way time of the "
            "longest range; of a file with one ping per row, of the median time between two rows.",
            at(&Scene::arrivals, &OtherPathsOptions::second_time_around)},
           {"bottom_loss_db", "dB", {0, 60},
            "Loss of a reflection at the bed, for multiples; unset: the reflection loss of "
            "seafloor.material at that angle, 10 dB if it is not a sediment.",
            at(&Scene::arrivals, &OtherPathsOptions::bottom_loss_db)},
           {"double_bounce", "", {},
            "Echoes by way of an object's wall and the bed before it, near the wall's foot: the wall "
            "mirrors the sonar by its direction, size and material, the bed reflects about the "
            "specular direction, and the paths in both directions add in amplitude.",
            at(&Scene::arrivals, &OtherPathsOptions::double_bounce)},
           {"wall_loss_db", "dB", {0, 60},
            "Loss of the reflection at a wall, which is then smooth; unset: the loss of its "
            "material, if that is a solid; other walls do not reflect.",
            at(&Scene::arrivals, &OtherPathsOptions::wall_loss_db)},
           {"burst_m", "m", {0, 1000},
            "Range over which the transmitted pulse blinds the receiver; 0: none.",
            at(&Scene::arrivals, &OtherPathsOptions::burst_m)},
           {"crosstalk_db", "dB", {-200, 0}, "Level of one side in the other; unset: no crosstalk.",
            at(&Scene::arrivals, &OtherPathsOptions::crosstalk_db)},
       }},
      {"artefacts",
       "Artefacts of real images, each with its own switch; NAME_pings.csv names those of each "
       "ping. (Heave, yaw and turns belong to motion and track.)",
       {
           {"lost", "", {0, 1}, "Share of pings that are not recorded.",
            at(&Scene::artefacts, &ArtefactOptions::lost)},
           {"repeated", "", {0, 1},
            "Share of the recorded pings that are replaced by a copy of the ping before.",
            at(&Scene::artefacts, &ArtefactOptions::repeated)},
           {"stale_navigation", "", {0, 0.99},
            "Share of the time in which the reported pose does not change.",
            at(&Scene::artefacts, &ArtefactOptions::stale_navigation)},
           {"stale_s", "s", {0.01, 3600}, "How long it stays unchanged, or longer where such times follow each other.",
            at(&Scene::artefacts, &ArtefactOptions::stale_s)},
           {"interference_db", "dB", {-60, 150},
            "Level of another sonar's burst in every ping, above the noise; unset: none.",
            at(&Scene::artefacts, &ArtefactOptions::interference_db)},
           {"interference_range_m", "m", {0, 20000}, "Its range in the first ping; 0: random.",
            at(&Scene::artefacts, &ArtefactOptions::interference_range_m)},
           {"interference_drift_m", "m", {-20000, 20000},
            "How far it moves from ping to ping; 0: at a fixed range; otherwise in diagonals.",
            at(&Scene::artefacts, &ArtefactOptions::interference_drift_m)},
           {"interference_length_m", "m", {0, 20000}, "Its length, in whole bins.",
            at(&Scene::artefacts, &ArtefactOptions::interference_length_m)},
           {"gain_step_db", "dB", {0, 60}, "Rms of the gain steps that the operator makes.",
            at(&Scene::artefacts, &ArtefactOptions::gain_step_db)},
           {"gain_step_s", "s", {0.01, 1e6}, "Time between them.",
            at(&Scene::artefacts, &ArtefactOptions::gain_step_s)},
           {"automatic_gain", "", {0, 1},
            "Share of the level's changes over range that an automatic gain removes.",
            at(&Scene::artefacts, &ArtefactOptions::automatic_gain)},
           {"automatic_gain_m", "m", {0.01, 20000}, "Range over which the automatic gain averages.",
            at(&Scene::artefacts, &ArtefactOptions::automatic_gain_m)},
           {"fish_per_hectare", "1/ha", {0, 6000},
            "Number of fish per hectare; each swims over the bed, so its shadow lies apart from it.",
            at(&Scene::artefacts, &ArtefactOptions::fish_per_hectare)},
           {"fish_strength_db", "dB re 1 m^2", {-120, 20}, "Target strength of one fish.",
            at(&Scene::artefacts, &ArtefactOptions::fish_strength_db)},
           {"fish_length_m", "m", {0.01, 20}, "Its length.",
            at(&Scene::artefacts, &ArtefactOptions::fish_length_m)},
           {"fish_height_m", "m", {0, 11000},
            "Greatest height over the bed at which they swim, where the water is deep enough.",
            at(&Scene::artefacts, &ArtefactOptions::fish_height_m)},
           {"wake_db", "dB", {-80, 40},
            "Backscattering strength of a ship's wake at its middle; unset: no wake.",
            at(&Scene::artefacts, &ArtefactOptions::wake_db)},
           {"wake_heading_deg", "degrees", {-360, 360},
            "Heading of the wake's line, clockwise from north.",
            at(&Scene::artefacts, &ArtefactOptions::wake_heading_rad)},
           {"wake_width_m", "m", {0.01, 1000}, "Its width.",
            at(&Scene::artefacts, &ArtefactOptions::wake_width_m)},
           {"wake_offset_m", "m", {-1e6, 1e6},
            "Distance of the line to starboard of the seabed's middle.",
            at(&Scene::artefacts, &ArtefactOptions::wake_offset_m)},
           {"shimmer_db", "dB", {0, 30}, "Rms change of the brightness by internal waves.",
            at(&Scene::artefacts, &ArtefactOptions::shimmer_db)},
           {"shimmer_m", "m", {0.01, 20000}, "Mean length of its bands over range.",
            at(&Scene::artefacts, &ArtefactOptions::shimmer_m)},
           {"shimmer_s", "s", {0.01, 1e6}, "Time in which a band of that length moves by its length.",
            at(&Scene::artefacts, &ArtefactOptions::shimmer_s)},
       }},
      {"run",
       "How a run is computed.",
       {
           {"surface", "", {},
            "Which triangles a ping sees. static: all, in one tree; refined: those in the fan, "
            "unchanged, of a mesh refined at each ping; footprint: the same by a query; auto: "
            "over a grid of heights footprint, or static where Embree's tree saves time; over a mesh "
            "refined, unless the run has too few pings for the analysis to save time.",
            at(&Scene::run, &RunOptions::surface), surface_choices()},
           {"intersector", "", {},
            "What finds the nearest hits (`ensonify intersectors` lists them). fan_scan is the "
            "fastest, and has the same bits on every machine.",
            at(&Scene::run, &RunOptions::intersector), words_of(intersector_kinds())},
           {"robust", "", {},
            "Whether embree uses its robust mode, in which far fewer rays slip between faces, at "
            "some cost in speed. The other intersectors let none through.",
            at(&Scene::run, &RunOptions::intersection, &IntersectorOptions::robust)},
           {"instruction_set", "", {},
            "Instruction set that embree uses, on which its last bits depend (sse4.2, avx2, avx512 "
            "...); empty: avx2.",
            at(&Scene::run, &RunOptions::intersection, &IntersectorOptions::instruction_set)},
           {"tree_pings", "", {1, 1000},
            "For how many pings one tree over the faces in the fan is used. For more pings there "
            "are fewer trees, each with more faces.",
            at(&Scene::run, &RunOptions::tree_pings)},
           {"block_pings", "", {1, 100000}, "Number of pings in the blocks that threads compute.",
            at(&Scene::run, &RunOptions::block_pings)},
       }},
      {"display",
       "From echoes to the image NAME.png; the layers of NAME.exr stay as received.",
       {
           {"of", "", {},
            "The layer that is shown; the recorder's gain is removed from samples first.",
            at(&Scene::display, &Display::of), {"sample", "intensity"}},
           {"spreading", "", {0, 80},
            "Gain over range, in dB per factor of ten: 30 makes a bed of constant strength even, "
            "50 a bed by Lambert's law. It ends where the expected noise is at medium brightness.",
            at(&Scene::display, &Display::spreading)},
           {"absorption", "", {}, "Whether the gain compensates absorption too.",
            at(&Scene::display, &Display::absorption)},
           {"slant_range_correction", "", {},
            "Whether columns are evenly spaced in ground range, without the water column; the "
            "image's columns are then not those of the layers.",
            at(&Scene::display, &Display::slant_range_correction)},
           {"speed_correction", "", {},
            "Whether the picture is to scale: its columns are as wide as pings are usually apart, "
            "but not narrower than a sample. The image's columns are then not those of the layers.",
            at(&Scene::display, &Display::speed_correction)},
           {"column_value", "", {},
            "What a column of several samples shows. mean: their mean amplitude; peak: the greatest, "
            "as displays do that must not lose small targets (brighter, and so are shadows); middle: "
            "the sample in its middle, as displays do that leave samples out (more grain).",
            at(&Scene::display, &Display::column_value), {"mean", "peak", "middle"}},
           {"beam_normalisation", "", {},
            "Whether each side's median level of the bed over the depression angle, the beam's "
            "pattern, is removed.",
            at(&Scene::display, &Display::beam_normalisation)},
           {"flat_field", "", {}, "Whether each column's median level of the bed is removed.",
            at(&Scene::display, &Display::flat_field)},
           {"gain_db", "dB", {-100, 100},
            "Added to the automatic gain, which puts the median of the scene's bed, taken as "
            "level and with all its materials, at medium brightness.",
            at(&Scene::display, &Display::gain_db)},
           {"mapping", "", {},
            "gamma: brightness is amplitude to a power; logarithmic: brightness is linear in "
            "decibels; equalised: all brightnesses are equally frequent.",
            at(&Scene::display, &Display::mapping), {"gamma", "logarithmic", "equalised"}},
           {"gamma", "", {0.05, 10},
            "The power of a gamma mapping. Medium brightness is 0.35 to this power, where white is 1.",
            at(&Scene::display, &Display::gamma)},
           {"range_db", "dB", {1, 200},
            "Range from black to white of a logarithmic mapping; medium brightness is in the "
            "middle.",
            at(&Scene::display, &Display::range_db)},
           {"smoothing_px", "px", {0, 20},
            "Smooths the picture as many displays do that enlarge or interpolate it: standard "
            "deviation of the Gaussian; 0: not smoothed.",
            at(&Scene::display, &Display::smoothing_px)},
           {"track_smoothing_px", "px", {0, 20},
            "The same along the track alone, in addition, as on displays that interpolate pings to "
            "evenly spaced rows; 0: none.",
            at(&Scene::display, &Display::track_smoothing_px)},
           {"palette", "", {}, "Colours; paper is grey with strong echoes dark.",
            at(&Scene::display, &Display::palette),
            {palette_names.begin(), palette_names.end()}},
       }},
      {"output",
       "Which files a run writes in addition to NAME.png, NAME_pings.csv and manifest.json.",
       output_keys()},
  };
}
}  // namespace
const std::vector<Section<Scene>>& scene_sections() { return made_once<made_scene_sections>(); }
// clang-format on

}  // namespace ensonify::engine
