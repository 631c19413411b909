#include <ensonify/engine/live/session.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <condition_variable>
#include <mutex>
#include <numbers>
#include <span>
#include <stdexcept>
#include <thread>
#include <utility>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <ensonify/engine/clock.h>
#include <ensonify/engine/live/change.h>
#include <ensonify/engine/live/frames.h>
#include <ensonify/engine/live/live_scene.h>
#include <ensonify/engine/live/mesh_viewer.h>
#include <ensonify/engine/live/setting.h>
#include <ensonify/engine/session_keys.h>
#include <ensonify/engine/simulator_internals.h>
#include <ensonify/engine/trace/face_sources/exact_faces.h>

namespace ensonify::engine {
namespace {

using namespace std::chrono_literals;
using Json = nlohmann::ordered_json;

constexpr double climb_mps = 1.0;        // vertical speed of an altitude change
constexpr double min_clearance_m = 0.5;  // above the bed and below the surface, off the track
constexpr auto between_views = 300ms;
constexpr auto between_status = 400ms;

std::string text_of(const Json& json) {
  return json.dump(-1, ' ', false, Json::error_handler_t::replace);
}

/// Changes that pages requested and the pinging thread has not yet applied.
struct PendingChanges {
  std::vector<std::pair<std::size_t, Sonar>> sonars;
  std::optional<Display> display;
  std::shared_ptr<LiveScene> world;
  std::vector<AddedObject> things;
  bool clear = false, again = false;
};

}  // namespace

struct LiveSession::Inner {
  explicit Inner(LiveOptions its_options)
      : options(std::move(its_options)),
        ring(options.ring_bytes),
        source(SessionScene::of_file(options.scene, options.overrides, options.data_folder)),
        rate(options.pings_per_s) {
    const Scene scene = as_watched(source.with());
    const auto progress = options.progress;
    world = std::make_shared<LiveScene>(scene, Preparation{.progress =
                                                               [&](std::string_view stage) {
                                                                 if (progress) progress(stage);
                                                               },
                                                           .memory = options.memory});
    current = scene;
    vehicle = {scene.track.altitude_m, scene.track.speed_mps};
    display = scene.display;
    held = options.hold;
    take_setting();
    ring.post(LatestFrame::bed, world->bed);
  }

  // ---- the pinging thread ----

  void ping_on() {
    try {
      Clock::time_point due = Clock::now();
      while (!stopping) {
        apply_pending();
        if (held || along >= static_cast<double>(world->track.count())) {
          finished = along >= static_cast<double>(world->track.count());
          report_status(true);
          std::unique_lock lock(pending_lock);
          woken.wait_for(lock, between_status, [&] { return bool(stopping) || changed; });
          changed = false;
          due = Clock::now();
          continue;
        }
        finished = false;
        ping();
        report_status(false);
        const double wanted = wanted_rate();
        if (wanted <= 0.0) continue;
        // After a slow ping it catches up, but by at most 50 ms.
        due = std::max(due + std::chrono::duration_cast<Clock::duration>(
                                 std::chrono::duration<double>(1.0 / wanted)),
                       Clock::now() - 50ms);
        std::unique_lock lock(pending_lock);
        woken.wait_until(lock, due, [&] { return bool(stopping); });
      }
    } catch (...) {
      const std::lock_guard lock(pending_lock);
      fault = std::current_exception();
      ring.close();
    }
  }

  double wanted_rate() {
    const std::lock_guard lock(pending_lock);
    return rate.value_or(1.0 / world->interval_s());
  }

  void ping() {
    Vehicle wanted;
    {
      const std::lock_guard lock(pending_lock);
      wanted = vehicle;
    }
    const double per_ping = wanted.speed_mps / world->scene.track.speed_mps;
    const double to_climb = wanted.altitude_m - world->scene.track.altitude_m - climbed_m;
    const double max_m = climb_mps * world->interval_s();
    climbed_m += std::clamp(to_climb, -max_m, max_m);
    try {
      publish(hear(per_ping));
      out_of_water = false;
    } catch (const std::invalid_argument& error) {  // a sonar is mounted out of the water
      if (!std::exchange(out_of_water, true)) report_trouble(error.what());
    }
    along += per_ping;
    ++pings;
    ++pings_since;
  }

  TrackPings::RecordedPing hear(double per_ping) {
    Simulator& simulator = world->simulator;
    const std::span<const Pose> poses = world->track.poses();
    const auto nth = static_cast<std::size_t>(along);
    const bool as_planned =
        on_track && climbed_m == 0.0 && along == static_cast<double>(nth) && nth == pings;
    if (as_planned) {
      const std::size_t block = world->track.block_of(nth);
      if (nth == 0 || block != world->track.block_of(nth - 1)) SimulatorInternals::reset(simulator);
      return world->track.hear(simulator, nth);
    }
    on_track = false;
    Pose pose = world->pose_at(along);
    pose.position.z() += climbed_m;
    const double over_m = simulator.altitude_m(pose.position);
    if (over_m < min_clearance_m) pose.position.z() += min_clearance_m - over_m;
    pose.position.z() = std::min(pose.position.z(), -min_clearance_m);
    pose.t_s = poses.front().t_s + static_cast<double>(pings) * world->interval_s();
    pose.velocity_mps *= per_ping;
    return {.record = {.pose = pose,
                       .reported = pose,
                       .altitude_m = simulator.altitude_m(pose.position)},
            .lines = simulator.ping_numbered(pose, pings)};
  }

  void publish(const TrackPings::RecordedPing& heard) {
    std::span<const EchoLine> lines = heard.lines;
    const std::span<const Sonar> sonars = world->simulator.sonars();
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
      std::vector<refine::FanVolume> volumes;
      for (const RayFan& fan : SimulatorInternals::aim(world->simulator, heard.record.pose))
        volumes.push_back(view_volume(fan));
      viewer->show(world, std::move(volumes));
      view_due = Clock::now() + between_views;
    }
  }

  void apply_pending() {
    PendingChanges taken;
    std::vector<Sonar> as_set;
    {
      const std::lock_guard lock(pending_lock);
      std::swap(taken, pending);
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
      // The sonars may have changed while the new scene was made ready.
      for (std::size_t i = 0; i < as_set.size(); ++i) set_sonar(i, as_set[i]);
      ring.post(LatestFrame::bed, world->bed);
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
    for (AddedObject& thing : taken.things) {
      put(thing);
      new_setting = true;  // it may add classes and materials
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
      report_trouble(error.what());
    }
  }

  void put(AddedObject& thing) {
    const Pose pose =
        world->pose_at(std::min(along, static_cast<double>(world->track.count() - 1)));
    const double sine = std::sin(pose.heading_rad), cosine = std::cos(pose.heading_rad);
    Pose place{.heading_rad = pose.heading_rad};
    place.position = {pose.position.x() + sine * thing.ahead_m + cosine * thing.starboard_m,
                      pose.position.y() + cosine * thing.ahead_m - sine * thing.starboard_m, 0.0};
    const double depth_m = world->simulator.altitude_m(place.position);
    if (!std::isfinite(depth_m)) {
      report_trouble("the object cannot be added: there is no seafloor at its position");
      return;
    }
    place.position.z() = -depth_m;
    things.push_back(world->simulator.add(std::move(thing.object), place));
  }

  void take_setting() {
    const Simulator& simulator = world->simulator;
    renderers.clear();
    rows.clear();
    const Display shown = line_display(display);
    for (std::size_t i = 0; i < simulator.sonars().size(); ++i) {
      const Sonar& sonar = simulator.sonars()[i];
      renderers.emplace_back(sonar, shown, simulator.calibration(i));
      rows.emplace_back(sonar, 1);
    }
    const auto kept = [](std::span<const std::string> names) {
      return std::make_shared<const std::vector<std::string>>(names.begin(), names.end());
    };
    classes = kept(simulator.classes());
    materials = kept(simulator.materials());
    setting = setting_frame(*world, display, options.scene.stem().string());
  }

  void report_status(bool at_rest) {
    const Clock::time_point now = Clock::now();
    const double since_s = seconds_since(status_reported);
    if (now - status_reported < between_status) return;
    status_reported = now;
    const StageTimes& all = SimulatorInternals::times(world->simulator);
    const double per_ping = pings_since > 0 ? 1000.0 / static_cast<double>(pings_since) : 0.0;
    const std::optional<MeshCounts> mesh = viewer->counts();
    const std::lock_guard lock(pending_lock);
    const double wanted = rate.value_or(1.0 / world->interval_s());
    Json json{{"along", along},
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
                {"speckle", per_ping * (all.receive_s - last_stages.receive_s)}}},
              {"vehicle", {{"altitude_m", vehicle.altitude_m}, {"speed_mps", vehicle.speed_mps}}},
              {"things", things.size()},
              {"pages", int(pages)}};
    if (mesh)
      json["mesh"] = {{"splits", mesh->splits},
                      {"collapses", mesh->collapses},
                      {"active_faces", mesh->active_faces},
                      {"exact_faces", mesh->exact_faces}};
    last_stages = all;
    pings_since = 0;
    ring.post(LatestFrame::status, json_frame(FrameKind::status, text_of(json)));
  }

  // ---- any thread ----

  void report_trouble(const std::string& what) {
    const std::lock_guard lock(pending_lock);
    trouble = what;
    ++trouble_number;
  }

  void change(std::string_view json) {
    const std::lock_guard one_at_a_time(change_lock);
    std::optional<SessionScene> now;
    Vehicle flown;
    {
      const std::lock_guard lock(pending_lock);
      now = source;
      flown = vehicle;
    }
    LiveChange asked = read_change(json, *now, flown);
    const bool seabed = asked.set && asked.set->seabed;
    if (seabed) claim_maker();
    {
      const std::lock_guard lock(pending_lock);
      if (asked.set) {
        source.keep(asked.set->keys);
        current = asked.set->scene;
        vehicle = asked.set->vehicle;
        for (auto& sonar : asked.set->sonars) pending.sonars.push_back(std::move(sonar));
        if (asked.set->display) pending.display = asked.set->display;
      }
      if (asked.hold) held = *asked.hold;
      if (asked.pings_per_s) rate = *asked.pings_per_s;
      if (asked.add) pending.things.push_back(std::move(*asked.add));
      pending.clear = pending.clear || asked.clear;
      pending.again = pending.again || asked.again;
      changed = true;
      woken.notify_all();
    }
    if (seabed) make_world(*asked.set);
  }

  void claim_maker() {
    const std::lock_guard lock(pending_lock);
    if (preparing)
      throw std::invalid_argument("another seabed is being made ready; try again after that");
    preparing = true;
  }

  /// Makes a changed scene ready in the background, while the old one continues.
  void make_world(const SceneChange& set) {
    if (maker.joinable()) maker.join();
    maker = std::thread([this, set] {
      std::shared_ptr<LiveScene> made;
      try {
        made = std::make_shared<LiveScene>(set.scene,
                                           Preparation{.threads = 1,
                                                       .progress =
                                                           [this](auto) {
                                                             if (stopping)
                                                               throw std::runtime_error("stopped");
                                                           },
                                                       .memory = options.memory});
      } catch (const std::exception& error) {
        report_trouble(error.what());
      }
      const std::lock_guard lock(pending_lock);
      preparing = false;
      if (made) {
        pending.world = std::move(made);
        changed = true;
        woken.notify_all();
      } else {  // later changes must not repeat values that failed
        source.take_back(set.keys, set.before);
      }
    });
  }

  LiveOptions options;
  LineRing ring;
  SessionScene source;  // with all changes so far: under pending_lock
  Scene current;

  std::mutex change_lock;  // locked before pending_lock
  std::mutex pending_lock;
  std::condition_variable woken;
  PendingChanges pending;
  std::optional<double> rate;
  Vehicle vehicle;
  bool changed = false, preparing = false;
  std::string trouble;
  std::uint64_t trouble_number = 0;
  std::exception_ptr fault;
  std::atomic<bool> held = false, stopping = false;
  std::atomic<int> pages = 0, mesh_pages = 0;

  // Used by the pinging thread only.
  std::shared_ptr<LiveScene> world;
  Display display;
  std::vector<Renderer> renderers;
  std::vector<Waterfall> rows;
  Bytes setting;
  std::shared_ptr<const std::vector<std::string>> classes, materials;
  std::vector<std::uint32_t> things;
  double along = 0.0, climbed_m = 0.0;
  std::uint64_t pings = 0, number = 0, pings_since = 0;
  bool on_track = true, finished = false, out_of_water = false;
  StageTimes last_stages;
  Clock::time_point status_reported{}, view_due{};

  std::optional<MeshViewer> viewer;  // from start() to stop()
  std::thread pinger, maker;
};

LiveSession::LiveSession(LiveOptions options)
    : inner_(std::make_unique<Inner>(std::move(options))) {}
LiveSession::~LiveSession() { stop(); }

void LiveSession::start() {
  inner_->viewer.emplace(inner_->ring,
                         [this](const std::string& what) { inner_->report_trouble(what); });
  inner_->pinger = std::thread([this] { inner_->ping_on(); });
}

void LiveSession::stop() {
  {
    const std::lock_guard lock(inner_->pending_lock);
    inner_->stopping = true;
  }
  inner_->woken.notify_all();
  inner_->ring.close();
  for (std::thread* thread : {&inner_->pinger, &inner_->maker})
    if (thread->joinable()) thread->join();
  inner_->viewer.reset();
}

std::exception_ptr LiveSession::fault() const {
  const std::lock_guard lock(inner_->pending_lock);
  return inner_->fault;
}

LineRing& LiveSession::ring() { return inner_->ring; }
void LiveSession::change(std::string_view json) { inner_->change(json); }

std::string LiveSession::truth(std::uint64_t number, std::size_t column) const {
  const auto line = inner_->ring.line(number);
  if (!line || column >= line->truth.size()) throw std::out_of_range("this line is no longer kept");
  const BinTruth& bin = line->truth[column];
  const auto name = [](const auto& names, std::size_t i) {
    return i > 0 && i < names.size() ? Json(names[i]) : Json();
  };
  const auto region = static_cast<Region>(bin.region);
  Json json{{"region", name_of(region)}};
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
