#include <ensonify/engine/live/mailbox.h>

#include <algorithm>
#include <iterator>
#include <stdexcept>

#include <fmt/format.h>

namespace ensonify::engine {
namespace {

constexpr std::size_t max_waiting = 64;  // objects

/// Adds a change to those that wait. Of each sonar only the latest settings stay, which include all
/// earlier ones: a page that sends changes faster than they are applied leaves no queue.
void add_to(std::optional<SceneChange>& all, const SceneChange& change) {
  if (!all) {
    all = change;
    return;
  }
  all->keys.insert(all->keys.end(), change.keys.begin(), change.keys.end());
  for (const auto& changed : change.sonars) {
    const auto same = [&](const auto& kept) { return kept.first == changed.first; };
    std::erase_if(all->sonars, same);
    all->sonars.push_back(changed);
  }
}

}  // namespace

Mailbox::Mailbox(SessionScene source, std::optional<double> pings_per_s, bool hold)
    : source_(std::move(source)) {
  status_.control = {.vehicle = {}, .pings_per_s = pings_per_s, .hold = hold};
}

std::pair<SessionScene, Vehicle> Mailbox::present() const {
  const std::lock_guard lock(lock_);
  return {source_, status_.control.vehicle};
}

void Mailbox::accept(const LiveChange& change) {
  const std::lock_guard lock(lock_);
  if (change.add && pending_.objects.size() >= max_waiting)
    throw std::invalid_argument(
        fmt::format("{} objects wait to be added; try again after that", max_waiting));
  Control& control = status_.control;
  if (change.set) {
    if (change.set->seabed && std::exchange(status_.preparing, true))
      throw std::invalid_argument("another seabed is being made ready; try again after that");
    source_.keep(change.set->keys);
    control.vehicle = change.set->vehicle;
    if (!change.set->sonars.empty()) {
      add_to(pending_.sonars, *change.set);
      if (status_.preparing) meanwhile_.push_back(*change.set);
    }
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
  pending_.sonars.reset();
  for (const SceneChange& change : std::exchange(meanwhile_, {})) add_to(pending_.sonars, change);
  changed_ = true;
  woken_.notify_all();
}

void Mailbox::give_up(const SceneChange& change, const std::string& trouble) {
  const std::lock_guard lock(lock_);
  status_.preparing = false;
  meanwhile_.clear();
  take_back(change.keys, change, trouble);
}

void Mailbox::take_back(std::span<const KeyValue> keys, const SceneChange& change,
                        const std::string& trouble) {
  source_.take_back(keys, change.before);
  status_.trouble = trouble;
  ++status_.trouble_number;
}

std::optional<PendingChanges> Mailbox::take() {
  const std::lock_guard lock(lock_);
  if (stopping_) return std::nullopt;
  changed_ = false;
  return std::exchange(pending_, {});
}

Control Mailbox::control() const {
  const std::lock_guard lock(lock_);
  return status_.control;
}

SessionStatus Mailbox::status() const {
  const std::lock_guard lock(lock_);
  return status_;
}

void Mailbox::set_vehicle(const Vehicle& vehicle) {
  const std::lock_guard lock(lock_);
  status_.control.vehicle = vehicle;
}

void Mailbox::wait_for_changes(std::chrono::milliseconds at_most) {
  std::unique_lock lock(lock_);
  woken_.wait_for(lock, at_most, [&] { return stopping_ || changed_; });
}

void Mailbox::wait_until(Clock::time_point due) {
  std::unique_lock lock(lock_);
  woken_.wait_until(lock, due, [&] { return stopping_; });
}

void Mailbox::refuse(const SceneChange& change, const std::string& trouble) {
  const std::lock_guard lock(lock_);
  std::erase_if(meanwhile_, [&](const SceneChange& kept) {
    return std::ranges::all_of(
        kept.keys, [&](const KeyValue& key) { return std::ranges::count(change.keys, key) > 0; });
  });
  std::vector<KeyValue> sonar_keys;
  std::ranges::copy_if(change.keys, std::back_inserter(sonar_keys), &is_sonar_key, &KeyValue::key);
  take_back(sonar_keys, change, trouble);
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
