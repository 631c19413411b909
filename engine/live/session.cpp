#include <ensonify/engine/live/session.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <condition_variable>
#include <mutex>
#include <numbers>
#include <set>
#include <stdexcept>
#include <thread>
#include <utility>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <ensonify/engine/live/frames.h>
#include <ensonify/engine/live/mesh_view.h>
#include <ensonify/engine/ping_all.h>
#include <ensonify/engine/scene/reader.h>
#include <ensonify/engine/seafloor/objects.h>
#include <ensonify/engine/simulate.h>
#include <ensonify/engine/trace/exact_surface.h>
#include <ensonify/scatter/sediment.h>

namespace ensonify::engine {
namespace {

using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;
using Json = nlohmann::ordered_json;

constexpr std::size_t map_points = 220;     // the longer side of the map
constexpr std::size_t track_points = 1500;  // of the track on it
constexpr double climb_mps = 1.0;           // at which another altitude is taken
constexpr double least_clearance_m =
    0.5;  // over the bed and below the surface, when it was changed
constexpr auto between_views = 300ms;
constexpr auto between_status = 400ms;
constexpr std::string_view altitude_key = "track.altitude_m", speed_key = "track.speed_mps";

double seconds(Clock::duration time) { return std::chrono::duration<double>(time).count(); }

Json strings(std::span<const std::string> all) {
  return Json(std::vector<std::string>(all.begin(), all.end()));
}

std::string text_of(const Json& json) {
  return json.dump(-1, ' ', false, Json::error_handler_t::replace);
}

double interval_of(std::span<const Pose> track) {
  const double between_s = track.size() > 1 ? track[1].t_s - track[0].t_s : 0.0;
  return between_s > 0.0 ? between_s : 0.1;
}

/// A scene made ready, which a changed seabed replaces.
struct World {
  Scene scene;
  Simulator simulator;
  TrackPings track;
  Bytes bed;

  World(const Scene& of, const Preparation& how)
      : scene(of), simulator(scene, how), track(scene, simulator), bed(map()) {}

  Bytes map() const {
    const refine::Bounds bounds = simulator.seafloor().bounds();
    BedMap map{.lowest = bounds.lowest.head<2>(), .highest = bounds.highest.head<2>()};
    const Eigen::Vector2f size = map.highest - map.lowest;
    const float step = size.maxCoeff() / static_cast<float>(map_points - 1);
    map.columns = static_cast<std::size_t>(std::max(2.0f, std::round(size.x() / step) + 1));
    map.rows = static_cast<std::size_t>(std::max(2.0f, std::round(size.y() / step) + 1));
    for (std::size_t row = 0; row < map.rows; ++row)
      for (std::size_t column = 0; column < map.columns; ++column) {
        // A little inwards, so that the outermost points lie on the bed.
        const auto along = [](std::size_t i, std::size_t of) {
          return 0.001 + 0.998 * static_cast<double>(i) / static_cast<double>(of - 1);
        };
        const Eigen::Vector3d place(map.lowest.x() + size.x() * along(column, map.columns),
                                    map.lowest.y() + size.y() * along(row, map.rows), 0.0);
        map.heights_m.push_back(static_cast<float>(-simulator.altitude_m(place)));
      }
    const std::span<const Pose> poses = track.poses();
    const std::size_t every = 1 + poses.size() / track_points;
    for (std::size_t i = 0; i < poses.size(); i += every)
      map.track.push_back(poses[i].position.head<2>().cast<float>());
    map.track.push_back(poses.back().position.head<2>().cast<float>());
    return bed_frame(map);
  }
};

Scene as_shown(Scene scene) {
  // A tree that stands costs a ping least; what is drawn has a mesh of its own.
  if (scene.run.surface == "auto") scene.run.surface = "static";
  return scene;
}

/// What a line by itself can show of a scene's display.
Display line_display(Display display) {
  display.beam_normalisation = display.flat_field = false;
  if (display.mapping == Mapping::equalised) display.mapping = Mapping::gamma;
  display.palette = Palette::grey;  // the page has the palettes
  return display;
}

Json palette_json(Palette palette) {
  Json colours = Json::array();
  for (int step = 0; step <= 255; ++step)
    for (const double channel : colour_of(palette, step / 255.0))
      colours.push_back(std::lround(255.0 * channel));
  return colours;
}

/// Between two poses of a track, or on one of them exactly.
Pose pose_at(std::span<const Pose> track, double along) {
  const auto i = static_cast<std::size_t>(along);
  const double share = along - static_cast<double>(i);
  Pose pose = track[i];
  if (share == 0.0 || i + 1 >= track.size()) return pose;
  const Pose& next = track[i + 1];
  const auto mix = [&](double a, double b) { return a + share * (b - a); };
  const auto turn = [&](double a, double b) {
    return a + share * std::remainder(b - a, 2.0 * std::numbers::pi);
  };
  pose.position += share * (next.position - pose.position);
  pose.roll_rad = turn(pose.roll_rad, next.roll_rad);
  pose.pitch_rad = turn(pose.pitch_rad, next.pitch_rad);
  pose.heading_rad = turn(pose.heading_rad, next.heading_rad);
  pose.t_s = mix(pose.t_s, next.t_s);
  return pose;
}

/// What the pages asked for, until the pinging thread takes it.
struct Wishes {
  std::vector<std::pair<std::size_t, Sonar>> sonars;
  std::optional<Display> display;
  std::shared_ptr<World> world;
  struct Thing {
    MovingObject object;
    double ahead_m, starboard_m;
  };
  std::vector<Thing> things;
  bool clear = false, again = false;
};

struct Vehicle {
  double altitude_m = 0.0, speed_mps = 0.0;  // wanted
};

double number_in(const Json& value, std::string_view what, double low, double high) {
  if (!value.is_number() || !(value.get<double>() >= low && value.get<double>() <= high))
    throw std::invalid_argument(fmt::format("'{}' is {}, expected a number from {} to {}", what,
                                            text_of(value), low, high));
  return value.get<double>();
}

bool truth_in(const Json& value, std::string_view what) {
  if (!value.is_boolean()) throw std::invalid_argument(fmt::format("'{}' is true or false", what));
  return value.get<bool>();
}

}  // namespace

struct LiveSession::Inner {
  explicit Inner(LiveOptions its_options)
      : options(std::move(its_options)), ring(options.ring_bytes), rate(options.pings_per_s) {
    Scene scene = as_shown(read_scene(options.scene, options.overrides, options.data_folder));
    const auto progress = options.progress;
    world = std::make_shared<World>(scene, Preparation{.progress = [&](std::string_view stage) {
                                      if (progress) progress(stage);
                                    }});
    current = scene;
    vehicle = {scene.track.altitude_m, scene.track.speed_mps};
    display = scene.display;
    held = options.hold;
    take_setting();
    ring.post(News::bed, world->bed);
  }

  // ---- the pinging thread ----

  void ping_on() {
    try {
      Clock::time_point due = Clock::now();
      while (!stopping) {
        take_wishes();
        if (held || along >= static_cast<double>(world->track.count())) {
          finished = along >= static_cast<double>(world->track.count());
          tell_status(true);
          std::unique_lock lock(wishes_lock);
          woken.wait_for(lock, between_status, [&] { return bool(stopping) || changed; });
          changed = false;
          due = Clock::now();
          continue;
        }
        finished = false;
        ping();
        tell_status(false);
        const double wanted = wanted_rate();
        if (wanted <= 0.0) continue;
        // On time again after a slow ping, but never in a hurry.
        due = std::max(due + std::chrono::duration_cast<Clock::duration>(
                                 std::chrono::duration<double>(1.0 / wanted)),
                       Clock::now() - 50ms);
        std::unique_lock lock(wishes_lock);
        woken.wait_until(lock, due, [&] { return bool(stopping); });
      }
    } catch (...) {
      const std::lock_guard lock(wishes_lock);
      fault = std::current_exception();
      ring.close();
    }
  }

  double wanted_rate() {
    const std::lock_guard lock(wishes_lock);
    return rate.value_or(1.0 / interval_of(world->track.poses()));
  }

  void ping() {
    Simulator& simulator = world->simulator;
    const std::span<const Pose> poses = world->track.poses();
    Vehicle wanted;
    {
      const std::lock_guard lock(wishes_lock);
      wanted = vehicle;
    }
    const double per_ping = wanted.speed_mps / world->scene.track.speed_mps;
    const double to_climb = wanted.altitude_m - world->scene.track.altitude_m - climbed_m;
    const double most_m = climb_mps * interval_of(poses);
    climbed_m += std::clamp(to_climb, -most_m, most_m);

    const auto nth = static_cast<std::size_t>(along);
    const bool as_planned =
        on_track && climbed_m == 0.0 && along == static_cast<double>(nth) && nth == pings;
    TrackPings::Heard heard;
    if (as_planned) {
      const std::size_t block = world->track.block_of(nth);
      if (nth == 0 || block != world->track.block_of(nth - 1)) simulator.reset();
      heard = world->track.hear(simulator, nth);
    } else {
      on_track = false;
      Pose pose = pose_at(poses, along);
      pose.position.z() += climbed_m;
      const double over_m = simulator.altitude_m(pose.position);
      if (over_m < least_clearance_m) pose.position.z() += least_clearance_m - over_m;
      pose.position.z() = std::min(pose.position.z(), -least_clearance_m);
      pose.t_s = poses.front().t_s + static_cast<double>(pings) * interval_of(poses);
      pose.velocity_mps *= per_ping;
      heard.record = {
          .pose = pose, .reported = pose, .altitude_m = simulator.altitude_m(pose.position)};
      heard.lines = simulator.ping(pose, pings);
    }
    publish(heard);
    along += per_ping;
    ++pings;
    ++pings_since;
  }

  void publish(const TrackPings::Heard& heard) {
    std::span<const EchoLine> lines = heard.lines;
    const std::span<const Sonar> sonars = world->simulator.sonars();
    std::vector<refine::ViewVolume> volumes;
    for (std::size_t i = 0; i < sonars.size(); ++i) {
      Waterfall& row = rows[i];
      const std::size_t sides = lines.empty() ? 0 : sides_of(sonars[i]).size();
      if (sides == 0) row.pixels.assign(row.columns());
      row.set_row(0, lines.first(sides), heard.record);
      lines = lines.subspan(sides);
      auto line = make_line(row, renderers[i], renderers[i].render(row), pings, i, number++);
      line->setting = setting;
      line->classes = classes;
      line->materials = materials;
      ring.push(std::move(line));
    }
    if (mesh_pages > 0 && Clock::now() >= view_due) {
      for (const RayFan& fan : world->simulator.aim(heard.record.pose))
        volumes.push_back(view_volume(fan));
      const std::lock_guard lock(view_lock);
      wanted_view = {world, std::move(volumes)};
      view_due = Clock::now() + between_views;
      view_wanted.notify_one();
    }
  }

  void take_wishes() {
    Wishes taken;
    std::vector<Sonar> as_set;
    {
      const std::lock_guard lock(wishes_lock);
      std::swap(taken, wishes);
      if (taken.world) as_set = current.sonars;
      changed = false;
    }
    bool new_setting = false;
    if (taken.world) {
      const double share = along / static_cast<double>(world->track.count());
      const bool at_begin = along == 0.0;
      world = std::move(taken.world);
      along = share * static_cast<double>(world->track.count());
      if (!at_begin) on_track = false;
      things.clear();
      last_stages = {};
      // They may have been changed while it was made ready.
      for (std::size_t i = 0; i < as_set.size(); ++i) set_sonar(i, as_set[i]);
      ring.post(News::bed, world->bed);
      new_setting = true;
    }
    for (const auto& [i, sonar] : taken.sonars) set_sonar(i, sonar), new_setting = true;
    if (taken.display) {
      display = *taken.display;
      new_setting = true;
    }
    if (taken.clear)
      for (const std::uint32_t instance : std::exchange(things, {}))
        world->simulator.remove(instance);
    for (Wishes::Thing& thing : taken.things) {
      put(thing);
      new_setting = true;  // classes and materials may be more
    }
    if (taken.again) {
      along = 0.0;
      pings = 0;
      on_track = climbed_m == 0.0;
    }
    if (new_setting) take_setting();
  }

  void set_sonar(std::size_t which, const Sonar& sonar) {
    try {
      world->simulator.set_sonar(which, sonar);
    } catch (const std::exception& error) {
      tell_trouble(error.what());
    }
  }

  void put(Wishes::Thing& thing) {
    const std::span<const Pose> poses = world->track.poses();
    Pose pose = pose_at(poses, std::min(along, static_cast<double>(poses.size() - 1)));
    const double sine = std::sin(pose.heading_rad), cosine = std::cos(pose.heading_rad);
    Pose place{.heading_rad = pose.heading_rad};
    place.position = {pose.position.x() + sine * thing.ahead_m + cosine * thing.starboard_m,
                      pose.position.y() + cosine * thing.ahead_m - sine * thing.starboard_m, 0.0};
    const double depth_m = world->simulator.altitude_m(place.position);
    if (!std::isfinite(depth_m)) {
      tell_trouble("there is no seafloor where that object was to lie");
      return;
    }
    place.position.z() = -depth_m;
    things.push_back(world->simulator.add(std::move(thing.object), place));
  }

  void take_setting() {
    const Simulator& simulator = world->simulator;
    renderers.clear();
    rows.clear();
    Json sonars = Json::array();
    const Display shown = line_display(display);
    for (std::size_t i = 0; i < simulator.sonars().size(); ++i) {
      const Sonar& sonar = simulator.sonars()[i];
      renderers.emplace_back(sonar, shown, simulator.calibration(i));
      rows.emplace_back(sonar, 1);
      sonars.push_back({{"name", sonar.name},
                        {"sides", sonar.sides == Sides::both   ? "both"
                                  : sonar.sides == Sides::port ? "port"
                                                               : "starboard"},
                        {"bins", sonar.bins},
                        {"range_m", sonar.range_m},
                        {"bin_m", sonar.bin_m()},
                        {"frequency_hz", sonar.frequency_hz},
                        {"source_level_db", sonar.source_level_db},
                        {"array_length_m", sonar.array_length_m},
                        {"bandwidth_hz", sonar.pulse.bandwidth_hz}});
    }
    classes = std::make_shared<const std::vector<std::string>>(simulator.classes().begin(),
                                                               simulator.classes().end());
    materials = std::make_shared<const std::vector<std::string>>(simulator.materials().begin(),
                                                                 simulator.materials().end());
    Json palettes;
    for (const auto& [name, palette] : {std::pair{"copper", Palette::copper},
                                        {"grey", Palette::grey},
                                        {"viridis", Palette::viridis},
                                        {"bronze", Palette::bronze},
                                        {"paper", Palette::paper}})
      palettes[name] = palette_json(palette);
    static constexpr std::array names{"grey", "copper", "bronze", "paper", "viridis"};
    std::vector<std::string> beds;
    for (const Material& material : world->scene.materials) beds.push_back(material.name);
    for (const scatter::NamedSediment& sediment : scatter::named_sediments())
      beds.emplace_back(sediment.name);
    const SeafloorOptions& bed = world->scene.seafloor;
    const Json json{{"scene", options.scene.stem().string()},
                    {"sonars", sonars},
                    {"classes", strings(*classes)},
                    {"materials", strings(*materials)},
                    {"palette", names[static_cast<std::size_t>(display.palette)]},
                    {"palettes", palettes},
                    {"display",
                     {{"gain_db", shown.gain_db},
                      {"gamma", shown.gamma},
                      {"range_db", shown.range_db},
                      {"mapping", shown.mapping == Mapping::gamma ? "gamma" : "logarithmic"},
                      {"ground", shown.slant_range_correction},
                      {"mid_amplitude", mid_amplitude},
                      {"evened", display.beam_normalisation || display.flat_field ||
                                     display.mapping == Mapping::equalised}}},
                    {"beds", beds},
                    {"bed",
                     {{"material", bed.material},
                      {"fractal", bed.kind == SeafloorKind::fractal},
                      {"height_at_1m_m", bed.fractal.height_at_1m_m},
                      {"ripple_height_m", bed.ripples.rms_height_m},
                      {"ripple_length_m", bed.ripples.wavelength_m}}},
                    {"faces", simulator.seafloor().faces},
                    {"surface", simulator.prepared().surface},
                    {"intersector", world->scene.run.intersector},
                    {"sound_speed_mps", simulator.sound_speed_mps()},
                    {"interval_s", interval_of(world->track.poses())},
                    {"pings", world->track.count()}};
    setting = json_frame(FrameKind::setting, text_of(json));
  }

  void tell_status(bool at_rest) {
    const Clock::time_point now = Clock::now();
    const double since_s = seconds(now - status_told);
    if (now - status_told < between_status) return;
    status_told = now;
    const StageTimes& all = world->simulator.times();
    const double per_ping = pings_since > 0 ? 1000.0 / static_cast<double>(pings_since) : 0.0;
    MeshCounts seen;
    bool view_ready;
    {
      const std::lock_guard lock(view_lock);
      seen = view_counts;
      view_ready = view_there;
    }
    const std::lock_guard lock(wishes_lock);
    const double wanted = rate.value_or(1.0 / interval_of(world->track.poses()));
    Json json{{"ping", pings},
              {"along", along},
              {"of", world->track.count()},
              {"hold", bool(held)},
              {"finished", bool(finished)},
              {"preparing", preparing},
              {"trouble", trouble},
              {"trouble_number", trouble_number},
              {"pings_per_s", at_rest ? 0.0 : static_cast<double>(pings_since) / since_s},
              {"wanted_pings_per_s", wanted},
              {"rate", rate ? Json(*rate) : Json()},
              {"stages_ms",
               {{"surface", per_ping * (all.surface_s - last_stages.surface_s)},
                {"trace", per_ping * (all.trace_s - last_stages.trace_s)},
                {"echo", per_ping * (all.echo_s - last_stages.echo_s)},
                {"speckle", per_ping * (all.speckle_s - last_stages.speckle_s)}}},
              {"vehicle", {{"altitude_m", vehicle.altitude_m}, {"speed_mps", vehicle.speed_mps}}},
              {"things", things.size()},
              {"pages", int(pages)},
              {"lines", number}};
    if (view_ready)
      json["mesh"] = {{"splits", seen.splits},
                      {"collapses", seen.collapses},
                      {"active_faces", seen.active_faces},
                      {"exact_faces", seen.exact_faces},
                      {"refine_ms", 1000.0 * seen.refine_s}};
    last_stages = all;
    pings_since = 0;
    ring.post(News::status, json_frame(FrameKind::status, text_of(json)));
  }

  // ---- the view's thread ----

  void view_on() {
    std::shared_ptr<World> shown;
    std::unique_ptr<MeshView> view;
    while (true) {
      View wanted;
      {
        std::unique_lock lock(view_lock);
        view_wanted.wait(lock, [&] { return stopping || wanted_view.world; });
        if (stopping) return;
        wanted = std::exchange(wanted_view, {});
      }
      try {
        if (wanted.world != shown) {
          view.reset();
          shown = wanted.world;
          view = std::make_unique<MeshView>(shown->simulator.seafloor());
          continue;  // what was wanted then is past
        }
        if (!view) continue;
        double range_m = 0.0;
        for (const refine::ViewVolume& volume : wanted.volumes)
          range_m = std::max(range_m, volume.range_m);
        const Clock::time_point start = Clock::now();
        ring.post(News::mesh, mesh_frame(view->look(wanted.volumes, 1.15 * range_m)));
        std::unique_lock lock(view_lock);
        view_counts = view->counts();
        view_there = true;
        // A quarter of a core at most.
        view_wanted.wait_for(lock, 3 * (Clock::now() - start), [&] { return bool(stopping); });
      } catch (const std::exception& error) {
        view.reset();
        tell_trouble(fmt::format("the mesh cannot be shown: {}", error.what()));
      }
    }
  }

  // ---- whoever asks ----

  void tell_trouble(const std::string& what) {
    const std::lock_guard lock(wishes_lock);
    trouble = what;
    ++trouble_number;
  }

  void change(std::string_view text) {
    const Json request = Json::parse(text, nullptr, false);
    if (!request.is_object() || request.empty())
      throw std::invalid_argument(R"(expected an object, as in {"set": {"track.altitude_m": 6}})");
    static const std::set<std::string, std::less<>> known{"set", "hold",  "pings_per_s",
                                                          "add", "clear", "again"};
    for (const auto& [key, value] : request.items())
      if (!known.contains(key))
        throw std::invalid_argument(fmt::format("nobody knows the key '{}'", key));
    const std::lock_guard one_at_a_time(change_lock);
    Wishes asked;
    std::optional<bool> hold;
    std::optional<std::optional<double>> other_rate;
    if (request.contains("hold")) hold = truth_in(request["hold"], "hold");
    if (request.contains("again")) asked.again = truth_in(request["again"], "again");
    if (request.contains("clear")) asked.clear = truth_in(request["clear"], "clear");
    if (const auto found = request.find("pings_per_s"); found != request.end()) {
      other_rate.emplace();
      if (!found->is_null()) *other_rate = number_in(*found, "pings_per_s", 0.0, 10000.0);
    }
    if (request.contains("add")) asked.things.push_back(thing_of(request["add"]));
    std::optional<Changed> set;
    if (request.contains("set")) set = settings_of(request["set"], asked);

    if (set && set->seabed) claim_maker();
    std::unique_lock lock(wishes_lock);
    if (set) {
      options.overrides = set->overrides;
      current = set->scene;
      vehicle = set->vehicle;
    }
    if (hold) held = *hold;
    if (other_rate) rate = *other_rate;
    for (auto& sonar : asked.sonars) wishes.sonars.push_back(std::move(sonar));
    for (auto& thing : asked.things) wishes.things.push_back(std::move(thing));
    if (asked.display) wishes.display = asked.display;
    wishes.clear = wishes.clear || asked.clear;
    wishes.again = wishes.again || asked.again;
    changed = true;
    woken.notify_all();
    lock.unlock();
    if (set && set->seabed) make_world(*set);
  }

  struct Changed {
    std::vector<std::string> overrides;
    Scene scene;
    Vehicle vehicle;
    std::size_t before = 0;  // how many overrides there were
    bool seabed = false;
  };

  Changed settings_of(const Json& keys, Wishes& asked) {
    if (!keys.is_object() || keys.empty())
      throw std::invalid_argument(
          R"('set' names no key, as {"set": {"track.altitude_m": 6}} does)");
    Changed to;
    std::vector<std::string> all;
    {
      const std::lock_guard lock(wishes_lock);
      all = to.overrides = options.overrides;
      to.vehicle = vehicle;
      to.before = to.overrides.size();
    }
    bool sonar = false, display_too = false;
    for (const auto& [key, value] : keys.items()) {
      const std::string line = fmt::format("{}={}", key, text_of(value));
      all.push_back(line);
      const bool flies = key == altitude_key || key == speed_key;
      if (!flies) to.overrides.push_back(line);  // the track stays where it is
      sonar = sonar || key.starts_with("sonar.");
      display_too = display_too || key.starts_with("display.");
      to.seabed = to.seabed || !(flies || key.starts_with("sonar.") || key.starts_with("display."));
    }
    const Scene checked = as_shown(read_scene(options.scene, all, options.data_folder));
    if (keys.contains(altitude_key)) to.vehicle.altitude_m = checked.track.altitude_m;
    if (keys.contains(speed_key)) to.vehicle.speed_mps = checked.track.speed_mps;
    to.scene = as_shown(read_scene(options.scene, to.overrides, options.data_folder));
    if (sonar && !to.seabed)
      for (std::size_t i = 0; i < to.scene.sonars.size(); ++i) {
        const std::string prefix = "sonar." + to.scene.sonars[i].name + ".";
        for (const auto& [key, value] : keys.items())
          if (key.starts_with(prefix)) {
            asked.sonars.emplace_back(i, to.scene.sonars[i]);
            break;
          }
      }
    if (display_too) asked.display = to.scene.display;
    return to;
  }

  Wishes::Thing thing_of(const Json& object) {
    if (!object.is_object() || object.empty())
      throw std::invalid_argument(
          R"('add' is no object, as {"shape": "barrel", "ahead_m": 10} is)");
    double ahead_m = 10.0, starboard_m = 10.0;
    std::string text = "version = 1\n[[objects]]\n";
    for (const auto& [key, value] : object.items()) {
      if (key == "ahead_m")
        ahead_m = number_in(value, key, -10000, 10000);
      else if (key == "starboard_m")
        starboard_m = number_in(value, key, -10000, 10000);
      else
        text += fmt::format("{}={}\n", key, text_of(value));
    }
    const std::filesystem::path folder = options.scene.parent_path();
    const Scene scene =
        parse_scene(text, "'add'", {}, {folder.empty() ? "." : folder, options.data_folder});
    if (scene.objects.size() != 1) throw std::invalid_argument("'add' is one object");
    const ObjectOptions& it = scene.objects.front();
    return {{.mesh = body_of(it, scene.seed), .material = it.material, .class_name = it.class_name},
            ahead_m,
            starboard_m};
  }

  void claim_maker() {
    const std::lock_guard lock(wishes_lock);
    if (preparing)
      throw std::invalid_argument("another seabed is being made ready; try again when it is there");
    preparing = true;
  }

  /// In the background, while the old one goes on.
  void make_world(const Changed& set) {
    if (maker.joinable()) maker.join();
    maker = std::thread([this, set] {
      std::shared_ptr<World> made;
      try {
        made =
            std::make_shared<World>(set.scene, Preparation{.threads = 1, .progress = [this](auto) {
                                                             if (stopping)
                                                               throw std::runtime_error("stopped");
                                                           }});
      } catch (const std::exception& error) {
        tell_trouble(error.what());
      }
      const std::lock_guard lock(wishes_lock);
      preparing = false;
      if (made) {
        wishes.world = std::move(made);
        changed = true;
        woken.notify_all();
      } else {  // what cannot be made is not asked for again
        std::erase_if(options.overrides, [&](const std::string& line) {
          return std::find(set.overrides.begin() + std::ptrdiff_t(set.before), set.overrides.end(),
                           line) != set.overrides.end();
        });
      }
    });
  }

  LiveOptions options;  // its overrides as they were changed: under wishes_lock
  LineRing ring;
  Scene current;

  std::mutex change_lock;  // taken first
  std::mutex wishes_lock;
  std::condition_variable woken;
  Wishes wishes;
  std::optional<double> rate;
  Vehicle vehicle;
  bool changed = false, preparing = false;
  std::string trouble;
  std::uint64_t trouble_number = 0;
  std::exception_ptr fault;
  std::atomic<bool> held = false, stopping = false;
  std::atomic<int> pages = 0, mesh_pages = 0;

  // the pinging thread's
  std::shared_ptr<World> world;
  Display display;
  std::vector<Renderer> renderers;
  std::vector<Waterfall> rows;
  Bytes setting;
  std::shared_ptr<const std::vector<std::string>> classes, materials;
  std::vector<std::uint32_t> things;
  double along = 0.0, climbed_m = 0.0;
  std::uint64_t pings = 0, number = 0, pings_since = 0;
  bool on_track = true, finished = false;
  StageTimes last_stages;
  Clock::time_point status_told{}, view_due{};

  struct View {
    std::shared_ptr<World> world;
    std::vector<refine::ViewVolume> volumes;
  };
  std::mutex view_lock;
  std::condition_variable view_wanted;
  View wanted_view;
  MeshCounts view_counts;
  bool view_there = false;

  std::thread pinger, viewer, maker;
};

LiveSession::LiveSession(LiveOptions options)
    : inner_(std::make_unique<Inner>(std::move(options))) {}
LiveSession::~LiveSession() { stop(); }

void LiveSession::start() {
  inner_->pinger = std::thread([this] { inner_->ping_on(); });
  inner_->viewer = std::thread([this] { inner_->view_on(); });
}

void LiveSession::stop() {
  {
    const std::scoped_lock lock(inner_->wishes_lock, inner_->view_lock);
    inner_->stopping = true;
  }
  inner_->woken.notify_all();
  inner_->view_wanted.notify_all();
  inner_->ring.close();
  for (std::thread* thread : {&inner_->pinger, &inner_->viewer, &inner_->maker})
    if (thread->joinable()) thread->join();
}

std::exception_ptr LiveSession::fault() const {
  const std::lock_guard lock(inner_->wishes_lock);
  return inner_->fault;
}

LineRing& LiveSession::ring() { return inner_->ring; }
void LiveSession::change(std::string_view json) { inner_->change(json); }

std::string LiveSession::truth(std::uint64_t number, std::size_t column) const {
  const auto line = inner_->ring.line(number);
  if (!line || column >= line->truth.size())
    throw std::out_of_range("that line is not kept any more");
  const BinTruth& bin = line->truth[column];
  const auto name = [](const auto& names, std::size_t i) {
    return i > 0 && i < names.size() ? Json(names[i]) : Json();
  };
  static constexpr std::array regions{"no data", "water column", "seabed", "object", "shadow"};
  const auto region = static_cast<Region>(bin.region);
  Json json{{"region", regions[std::min<std::size_t>(bin.region, regions.size() - 1)]}};
  if (region == Region::seabed || region == Region::object)
    json.update({{"x_m", bin.x_m},
                 {"y_m", bin.y_m},
                 {"z_m", bin.z_m},
                 {"grazing_deg", bin.grazing_rad * 180.0 / std::numbers::pi},
                 {"sediment", name(*line->materials, bin.sediment)},
                 {"class", name(*line->classes, bin.class_id)},
                 {"instance", bin.instance}});
  if (region == Region::shadow) json["shadow_instance"] = bin.shadow_instance;
  return text_of(json);
}

LiveSession::Watch::Watch(LiveSession& session, bool mesh) : session_(session), mesh_(mesh) {
  ++session_.inner_->pages;
  if (mesh_) ++session_.inner_->mesh_pages;
}
LiveSession::Watch::~Watch() {
  --session_.inner_->pages;
  if (mesh_) --session_.inner_->mesh_pages;
}

}  // namespace ensonify::engine
