#include <ensonify/engine/live/mailbox.h>

#include <algorithm>
#include <iterator>
#include <stdexcept>
#include <utility>

#include <fmt/format.h>

namespace ensonify::engine {
namespace {

constexpr std::size_t max_waiting = 64;  // objects that wait to be added

/// Adds a change to the waiting changes. Of each sonar only the latest settings are kept, because
/// they include all earlier ones. So a page that sends changes too fast makes no queue.
void add_to(std::optional<SceneChange>& all, const SceneChange& change) {
  if (!all) {
    all = change;
    return;
  }
  all->keys.insert(all->keys.end(), change.keys.begin(), change.keys.end());
  for (const auto& changed : change.sonars) {
    std::erase_if(all->sonars, [&](const auto& kept) { return kept.first == changed.first; });
    all->sonars.push_back(changed);
  }
}

}  // namespace

Mailbox::Mailbox(SessionScene source, std::optional<double> pings_per_s, bool hold)
    : source_(std::move(source)) {
  status_.control = {.vehicle = {}, .pings_per_s = pings_per_s, .hold = hold};
}

void Mailbox::accept(const LiveChange& change) {
  const std::lock_guard lock(lock_);
  if (change.add && pending_.objects.size() + pending_.objects_after_again.size() >= max_waiting)
    throw std::invalid_argument(
        fmt::format("{} objects wait to be added; try again after that", max_waiting));
  Control& control = status_.control;
  if (change.set && change.set->seabed) {
    if (std::exchange(status_.preparing, true))
      throw std::invalid_argument("another seabed is being made ready; try again after that");
    keys_meanwhile_.clear();
    vehicle_meanwhile_ = {};
  } else if (change.set) {
    const SceneChange& set = *change.set;
    source_.keep(set.keys);
    control.vehicle = set.vehicle.applied_to(control.vehicle);
    if (!set.sonars.empty()) add_to(pending_.sonars, set);
    if (set.display) pending_.display = set.display;
    if (status_.preparing) {
      keys_meanwhile_.insert(keys_meanwhile_.end(), set.keys.begin(), set.keys.end());
      vehicle_meanwhile_ = vehicle_meanwhile_.then(set.vehicle);
    }
  }
  if (change.hold) control.hold = *change.hold;
  if (change.pings_per_s) control.pings_per_s = *change.pings_per_s;
  if (change.clear) {
    pending_.clear = true;
    pending_.objects.clear();
    pending_.objects_after_again.clear();
  }
  if (change.add)
    (pending_.again ? pending_.objects_after_again : pending_.objects).push_back(*change.add);
  pending_.again = pending_.again || change.again;
  changed_ = true;
  woken_.notify_all();
}

void Mailbox::count_page(int more, bool mesh) {
  const std::lock_guard lock(lock_);
  status_.control.pages += more;
  if (mesh) status_.control.mesh_pages += more;
}

void Mailbox::deliver(std::shared_ptr<LiveScene> live_scene, const SceneChange& change) {
  const std::lock_guard lock(lock_);
  status_.preparing = false;
  pending_.live_scene = std::move(live_scene);
  pending_.sonars.reset();
  pending_.display = change.scene.display;
  Vehicle& vehicle = status_.control.vehicle;
  vehicle = change.vehicle.then(vehicle_meanwhile_).applied_to(vehicle);
  source_ = change.before;
  source_.keep(change.keys);
  try {
    const SceneChange later = scene_change(keys_meanwhile_, source_);
    source_.keep(later.keys);
    if (!later.sonars.empty()) pending_.sonars = later;
    pending_.display = later.scene.display;
  } catch (const std::exception& error) {
    note_trouble(
        fmt::format("changes that do not fit the new seabed are undone: {}", error.what()));
  }
  changed_ = true;
  woken_.notify_all();
}

void Mailbox::give_up(const std::string& trouble) {
  const std::lock_guard lock(lock_);
  status_.preparing = false;
  note_trouble(trouble);
}

void Mailbox::note_trouble(const std::string& what) {
  status_.trouble = what;
  ++status_.trouble_number;
}

std::optional<PendingChanges> Mailbox::take() {
  const std::lock_guard lock(lock_);
  if (stopping_) return std::nullopt;
  changed_ = false;
  return std::exchange(pending_, {});
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
  std::vector<KeyValue> sonar_keys;
  std::ranges::copy_if(change.keys, std::back_inserter(sonar_keys), &is_sonar_key, &KeyValue::key);
  std::erase_if(keys_meanwhile_, [&](const KeyValue& kept) {
    return std::ranges::find(sonar_keys, kept) != sonar_keys.end();
  });
  source_.take_back(sonar_keys, change.before);
  note_trouble(trouble);
}

void Mailbox::fail(std::exception_ptr fault) {
  const std::lock_guard lock(lock_);
  fault_ = std::move(fault);
}

void Mailbox::report_trouble(const std::string& what) {
  const std::lock_guard lock(lock_);
  note_trouble(what);
}

void Mailbox::stop() {
  const std::lock_guard lock(lock_);
  stopping_ = true;
  woken_.notify_all();
}

}  // namespace ensonify::engine
