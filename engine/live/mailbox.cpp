#include <ensonify/engine/live/mailbox.h>

#include <stdexcept>

namespace ensonify::engine {

Mailbox::Mailbox(SessionScene source, const Scene& scene, std::optional<double> pings_per_s,
                 bool hold)
    : source_(std::move(source)), sonars_(scene.sonars) {
  status_.control = {.vehicle = {scene.track.altitude_m, scene.track.speed_mps},
                     .pings_per_s = pings_per_s,
                     .hold = hold};
}

std::pair<SessionScene, Vehicle> Mailbox::present() const {
  const std::lock_guard lock(lock_);
  return {source_, status_.control.vehicle};
}

void Mailbox::accept(const LiveChange& change) {
  const std::lock_guard lock(lock_);
  Control& control = status_.control;
  if (change.set) {
    if (change.set->seabed && std::exchange(status_.preparing, true))
      throw std::invalid_argument("another seabed is being made ready; try again after that");
    source_.keep(change.set->keys);
    sonars_ = change.set->scene.sonars;
    control.vehicle = change.set->vehicle;
    pending_.sonars.insert(pending_.sonars.end(), change.set->sonars.begin(),
                           change.set->sonars.end());
    if (change.set->display) pending_.display = change.set->display;
  }
  if (change.hold) control.hold = *change.hold;
  if (change.pings_per_s) control.pings_per_s = *change.pings_per_s;
  if (change.add) pending_.objects.push_back(*change.add);
  pending_.clear = pending_.clear || change.clear;
  pending_.again = pending_.again || change.again;
  changed_ = true;
  woken_.notify_all();
}

void Mailbox::page_opened(bool mesh) {
  const std::lock_guard lock(lock_);
  ++status_.control.pages;
  if (mesh) ++status_.control.mesh_pages;
}

void Mailbox::page_closed(bool mesh) {
  const std::lock_guard lock(lock_);
  --status_.control.pages;
  if (mesh) --status_.control.mesh_pages;
}

void Mailbox::deliver(std::shared_ptr<LiveScene> live_scene) {
  const std::lock_guard lock(lock_);
  status_.preparing = false;
  pending_.live_scene = std::move(live_scene);
  changed_ = true;
  woken_.notify_all();
}

void Mailbox::give_up(const SceneChange& change, const std::string& trouble) {
  const std::lock_guard lock(lock_);
  status_.preparing = false;
  status_.trouble = trouble;
  ++status_.trouble_number;
  source_.take_back(change.keys, change.before);
}

std::optional<PendingChanges> Mailbox::take() {
  const std::lock_guard lock(lock_);
  if (stopping_) return std::nullopt;
  changed_ = false;
  PendingChanges taken = std::exchange(pending_, {});
  if (taken.live_scene) {
    // The sonars may have changed while it was made ready.
    taken.sonars.clear();
    for (std::size_t i = 0; i < sonars_.size(); ++i) taken.sonars.emplace_back(i, sonars_[i]);
  }
  return taken;
}

Control Mailbox::control() const {
  const std::lock_guard lock(lock_);
  return status_.control;
}

SessionStatus Mailbox::status() const {
  const std::lock_guard lock(lock_);
  return status_;
}

void Mailbox::wait_for_changes(std::chrono::milliseconds at_most) {
  std::unique_lock lock(lock_);
  woken_.wait_for(lock, at_most, [&] { return stopping_ || changed_; });
}

void Mailbox::wait_until(Clock::time_point due) {
  std::unique_lock lock(lock_);
  woken_.wait_until(lock, due, [&] { return stopping_; });
}

void Mailbox::fail(std::exception_ptr fault) {
  const std::lock_guard lock(lock_);
  fault_ = std::move(fault);
}

void Mailbox::report_trouble(const std::string& what) {
  const std::lock_guard lock(lock_);
  status_.trouble = what;
  ++status_.trouble_number;
}

void Mailbox::stop() {
  const std::lock_guard lock(lock_);
  stopping_ = true;
  woken_.notify_all();
}

bool Mailbox::stopping() const {
  const std::lock_guard lock(lock_);
  return stopping_;
}

std::exception_ptr Mailbox::fault() const {
  const std::lock_guard lock(lock_);
  return fault_;
}

}  // namespace ensonify::engine
