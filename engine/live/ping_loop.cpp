#include <ensonify/engine/live/ping_loop.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <optional>
#include <span>
#include <stdexcept>
#include <utility>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <ensonify/engine/base/json_text.h>
#include <ensonify/engine/live/frames.h>
#include <ensonify/engine/simulator/internals.h>
#include <ensonify/engine/trace/face_sources/exact_faces.h>

namespace ensonify::engine {
namespace {

using namespace std::chrono_literals;
using Json = nlohmann::ordered_json;

constexpr double climb_mps = 1.0;  // vertical speed of an altitude change
constexpr double min_clearance_m =
    0.5;  // to the bed and to the sea surface, for poses off the track
constexpr auto between_views = 300ms;
constexpr auto between_status = 400ms;

std::shared_ptr<const std::vector<std::string>> kept(std::span<const std::string> names) {
  return std::make_shared<const std::vector<std::string>>(names.begin(), names.end());
}

}  // namespace

PingLoop::PingLoop(std::shared_ptr<LiveScene> live_scene, std::string name, Mailbox& mailbox,
                   LineRing& ring)
    : mailbox_(mailbox),
      ring_(ring),
      name_(std::move(name)),
      live_scene_(std::move(live_scene)),
      planned_(live_scene_->planned()),
      display_(live_scene_->scene.display),
      warnings_(live_scene_->all_warnings()) {
  mailbox_.set_vehicle(planned_);
  take_setting();
  ring_.post(LatestFrame::bed, live_scene_->bed);
}

void PingLoop::run() {
  try {
    MeshViewer viewer(ring_, [this](const std::string& what) { mailbox_.report_trouble(what); });
    Clock::time_point due = Clock::now();
    while (std::optional<PendingChanges> changes = mailbox_.take()) {
      apply(std::move(*changes));
      const Control control = mailbox_.control();
      if (control.hold || at_end()) {
        report_status(true, viewer);
        mailbox_.wait_for_changes(between_status);
        due = Clock::now();
        continue;
      }
      ping(control, viewer);
      report_status(false, viewer);
      const double rate = wanted_rate(mailbox_.control());
      if (rate <= 0.0) continue;
      // After a slow ping the next ones come sooner, by at most 50 ms in all.
      due = std::max(due + std::chrono::duration_cast<Clock::duration>(
                               std::chrono::duration<double>(1.0 / rate)),
                     Clock::now() - 50ms);
      mailbox_.wait_until(due);
    }
  } catch (...) {
    if (!mailbox_.stopping()) mailbox_.fail(std::current_exception());
    ring_.close();
  }
}

bool PingLoop::at_end() const { return along_ >= static_cast<double>(live_scene_->track.count()); }

double PingLoop::wanted_rate(const Control& control) const {
  return control.pings_per_s.value_or(1.0 / live_scene_->interval_s());
}

void PingLoop::apply(PendingChanges changes) {
  const bool new_setting = changes.live_scene || changes.sonars || changes.display ||
                           // Objects may add classes and materials.
                           !changes.objects.empty() || !changes.objects_after_again.empty();
  if (changes.live_scene) replace_scene(std::move(changes.live_scene));
  if (changes.sonars) try {
      live_scene_->simulator.set_sonars(changes.sonars->sonars);
    } catch (const std::exception& error) {
      mailbox_.refuse(*changes.sonars, error.what());
    }
  if (changes.display) display_ = *changes.display;
  if (changes.clear)
    for (const ObjectOnBed& added : std::exchange(added_, {}))
      live_scene_->simulator.remove(added.instance);
  for (AddedObject& added : changes.objects) put(added);
  if (changes.again) {
    along_ = 0.0;
    pings_ = 0;
    climbed_m_ = mailbox_.control().vehicle.altitude_m - planned_.altitude_m;
    on_track_ = climbed_m_ == 0.0;
  }
  for (AddedObject& added : changes.objects_after_again) put(added);
  if (new_setting) {
    take_setting();
    report_new_warnings();
  }
}

void PingLoop::replace_scene(std::shared_ptr<LiveScene> live_scene) {
  const double share = along_ / static_cast<double>(live_scene_->track.count());
  const bool at_begin = along_ == 0.0;
  live_scene_ = std::move(live_scene);
  along_ = share * static_cast<double>(live_scene_->track.count());
  if (!at_begin) on_track_ = false;
  for (ObjectOnBed& added : std::exchange(added_, {}))
    set_down(std::move(added.object), added.place);
  stages_before_ = {};
  ring_.post(LatestFrame::bed, live_scene_->bed);
}

void PingLoop::put(AddedObject& added) {
  const Pose pose =
      live_scene_->pose_at(std::min(along_, static_cast<double>(live_scene_->track.count() - 1)));
  const double sine = std::sin(pose.heading_rad), cosine = std::cos(pose.heading_rad);
  Pose place{.heading_rad = pose.heading_rad};
  place.position = {pose.position.x() + sine * added.ahead_m + cosine * added.starboard_m,
                    pose.position.y() + cosine * added.ahead_m - sine * added.starboard_m, 0.0};
  set_down(std::move(added.object), place);
}

/// Adds an object at the height of the bed, and keeps it in added_, to set it down on the next bed.
void PingLoop::set_down(MovingObject object, Pose place) {
  if (mailbox_.stopping()) return;
  place.position.z() = 0.0;
  const double depth_m = live_scene_->simulator.altitude_m(place.position);
  if (!std::isfinite(depth_m)) {
    mailbox_.report_trouble("the object cannot be added: there is no seafloor at its position");
    return;
  }
  place.position.z() = -depth_m;
  try {
    const std::uint32_t instance = live_scene_->simulator.add(object, place);
    added_.push_back({std::move(object), place, instance});
  } catch (const std::exception& error) {
    mailbox_.report_trouble(error.what());
  }
}

void PingLoop::take_setting() {
  const Simulator& simulator = live_scene_->simulator;
  renderers_.clear();
  rows_.clear();
  const Display shown = line_display(display_);
  for (std::size_t i = 0; i < simulator.sonars().size(); ++i) {
    Sonar sonar = simulator.sonars()[i];
    renderers_.emplace_back(sonar, shown, simulator.calibration(i));
    sonar.beams = 1;  // a line is one row
    rows_.emplace_back(sonar, 1);
  }
  classes_ = kept(simulator.classes());
  materials_ = kept(simulator.materials());
  setting_ = setting_frame(*live_scene_, display_, name_);
  ring_.post(LatestFrame::setting, setting_);
}

void PingLoop::report_new_warnings() {
  std::vector<std::string> all = live_scene_->all_warnings();
  std::string fresh;
  for (const std::string& warning : all)
    if (std::ranges::find(warnings_, warning) == warnings_.end())
      fresh += fmt::format("{}{}", fresh.empty() ? "" : "; ", warning);
  if (!fresh.empty()) mailbox_.report_trouble(fresh);
  warnings_ = std::move(all);
}

void PingLoop::ping(const Control& control, MeshViewer& viewer) {
  // On a track without speed, the vehicle's speed has no effect.
  const double per_ping =
      planned_.speed_mps > 0.0 ? control.vehicle.speed_mps / planned_.speed_mps : 1.0;
  const double to_climb = control.vehicle.altitude_m - planned_.altitude_m - climbed_m_;
  const double max_m = climb_mps * live_scene_->interval_s();
  climbed_m_ += std::clamp(to_climb, -max_m, max_m);
  const std::size_t warnings = live_scene_->simulator.warnings().size();
  try {
    const TrackPings::PingRecord ping = record_ping(per_ping);
    publish(ping);
    if (live_scene_->simulator.warnings().size() > warnings) report_new_warnings();
    if (control.mesh_pages > 0) show_mesh(ping.row.pose, viewer);
    out_of_water_ = false;
  } catch (const std::invalid_argument& error) {  // a sonar is mounted out of the water
    if (!std::exchange(out_of_water_, true)) mailbox_.report_trouble(error.what());
  }
  along_ += per_ping;
  ++pings_;
  ++pings_since_;
}

TrackPings::PingRecord PingLoop::record_ping(double per_ping) {
  Simulator& simulator = live_scene_->simulator;
  const TrackPings& track = live_scene_->track;
  const auto nth = static_cast<std::size_t>(along_);
  const bool as_planned =
      on_track_ && climbed_m_ == 0.0 && along_ == static_cast<double>(nth) && nth == pings_;
  if (as_planned) {
    if (nth == 0 || track.block_of(nth) != track.block_of(nth - 1))
      SimulatorInternals::reset(simulator);
    return track.record_ping(simulator, nth);
  }
  on_track_ = false;
  Pose pose = live_scene_->pose_at(along_);
  const double planned_z_m = pose.position.z();
  pose.position.z() += climbed_m_;
  const double over_m = simulator.altitude_m(pose.position);
  if (over_m < min_clearance_m) pose.position.z() += min_clearance_m - over_m;
  pose.position.z() = std::min(pose.position.z(), -min_clearance_m);
  climbed_m_ = pose.position.z() - planned_z_m;  // the next climb begins at this height
  pose.t_s = track.poses().front().t_s + static_cast<double>(pings_) * live_scene_->interval_s();
  pose.velocity_mps *= per_ping;
  return {
      .row = {.pose = pose, .reported = pose, .altitude_m = simulator.altitude_m(pose.position)},
      .lines = simulator.ping_numbered(pose, pings_)};
}

void PingLoop::publish(const TrackPings::PingRecord& ping) {
  std::span<const EchoLine> lines = ping.lines;
  const std::span<const Sonar> sonars = live_scene_->simulator.sonars();
  for (std::size_t i = 0; i < sonars.size(); ++i) {
    Waterfall& row = rows_[i];
    const std::size_t sectors = lines.empty() ? 0 : sonars[i].sectors().size();
    if (sectors == 0) row.pixels.assign(row.columns());
    for (int beam = 0; beam < sonars[i].beams; ++beam) {
      row.set_row(0, lines.first(sectors), row_of_beam(ping.row, sonars[i], beam));
      lines = lines.subspan(sectors);
      auto line = make_line(row, renderers_[i], renderers_[i].render(row), pings_, i, lines_++);
      line->setting = setting_;
      line->classes = classes_;
      line->materials = materials_;
      ring_.push(std::move(line));
    }
  }
}

void PingLoop::show_mesh(const Pose& pose, MeshViewer& viewer) {
  if (Clock::now() < view_due_) return;
  std::vector<refine::FanVolume> volumes;
  for (const RayFan& fan : SimulatorInternals::aim(live_scene_->simulator, pose))
    volumes.push_back(fan_volume_of(fan));
  viewer.show(live_scene_, std::move(volumes));
  view_due_ = Clock::now() + between_views;
}

void PingLoop::report_status(bool at_rest, const MeshViewer& viewer) {
  const Clock::time_point now = Clock::now();
  if (now - status_reported_ < between_status) return;
  const double since_s = seconds_since(std::exchange(status_reported_, now));
  const StageTimes& stages = SimulatorInternals::times(live_scene_->simulator);
  const StageTimes since = stages - std::exchange(stages_before_, stages);
  const std::uint64_t pings = std::exchange(pings_since_, 0);
  const double per_ping = pings > 0 ? 1000.0 / static_cast<double>(pings) : 0.0;
  const SessionStatus status = mailbox_.status();
  const Control& control = status.control;
  Json json{
      {"along", along_},
      {"of", live_scene_->track.count()},
      {"hold", control.hold},
      {"finished", at_rest && at_end()},
      {"preparing", status.preparing},
      {"trouble", status.trouble},
      {"trouble_number", status.trouble_number},
      {"pings_per_s", at_rest ? 0.0 : static_cast<double>(pings) / since_s},
      {"wanted_pings_per_s", wanted_rate(control)},
      {"rate", control.pings_per_s ? Json(*control.pings_per_s) : Json()},
      {"stages_ms",
       {{"surface", per_ping * since.surface_s},
        {"trace", per_ping * since.trace_s},
        {"echo", per_ping * since.echo_s},
        {"receiver", per_ping * since.receive_s}}},
      {"vehicle",
       {{"altitude_m", control.vehicle.altitude_m}, {"speed_mps", control.vehicle.speed_mps}}},
      {"things", added_.size()},
      {"pages", control.pages}};
  if (const std::optional<MeshCounts> mesh = viewer.counts())
    json["mesh"] = {{"splits", mesh->splits},
                    {"collapses", mesh->collapses},
                    {"active_faces", mesh->active_faces},
                    {"exact_faces", mesh->exact_faces}};
  ring_.post(LatestFrame::status, json_frame(FrameKind::status, json_text(json)));
}

}  // namespace ensonify::engine
