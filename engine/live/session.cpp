#include <ensonify/engine/live/session.h>

#include <mutex>
#include <stdexcept>
#include <thread>
#include <utility>

#include <nlohmann/json.hpp>

#include <ensonify/engine/base/json_text.h>
#include <ensonify/engine/base/units.h>
#include <ensonify/engine/live/change.h>
#include <ensonify/engine/live/live_scene.h>
#include <ensonify/engine/live/mailbox.h>
#include <ensonify/engine/live/ping_loop.h>
#include <ensonify/engine/session_keys.h>
#include <ensonify/engine/simulator/prepare.h>

namespace ensonify::engine {

/// The threads share the ring and the mailbox, each with its own lock, and what change_lock guards.
struct LiveSession::Inner {
  explicit Inner(LiveOptions its_options)
      : Inner(its_options, SessionScene::of_file(its_options.scene, its_options.overrides,
                                                 its_options.data_folder)) {}

  Inner(const LiveOptions& its_options, const SessionScene& source)
      : memory(its_options.memory),
        ring(its_options.ring_bytes),
        mailbox(source, its_options.pings_per_s, its_options.hold),
        loop(std::make_shared<LiveScene>(with_session_surface(source.with()),
                                         Preparation{.cache = its_options.cache,
                                                     .progress = its_options.progress,
                                                     .stop_check = [this] { stop_check(); },
                                                     .memory = memory}),
             its_options.scene.stem().string(), mailbox, ring) {}

  void stop_check() const {
    if (mailbox.stopping()) throw std::runtime_error("stopped");
  }

  void change(std::string_view json) {
    const std::lock_guard one_at_a_time(change_lock);
    const LiveChange asked = read_change(json, mailbox.present(), objects);
    mailbox.accept(asked);
    if (asked.add) ++objects;
    if (asked.set && asked.set->seabed) prepare(*asked.set);
  }

  /// Makes a changed scene ready in the background, while the old one continues.
  void prepare(const SceneChange& set) {
    if (prepare_thread.joinable()) prepare_thread.join();
    prepare_thread = std::thread([this, set] {
      try {
        auto live_scene = std::make_shared<LiveScene>(
            set.scene, Preparation{.threads = 1,
                                   .progress = [this](auto) { stop_check(); },
                                   .stop_check = [this] { stop_check(); },
                                   .memory = memory});
        // change() must not be between read_change() and accept().
        const std::lock_guard one_at_a_time(change_lock);
        mailbox.deliver(std::move(live_scene), set);
      } catch (const std::exception& error) {
        mailbox.give_up(error.what());
      }
    });
  }

  const MemoryLimit memory;
  LineRing ring;
  Mailbox mailbox;
  PingLoop loop;  // used by the ping thread only, from start() to stop()
  std::thread ping_thread;

  std::mutex change_lock;     // guards the members below; changes are made one at a time
  std::uint32_t objects = 0;  // number of objects that were added
  std::thread prepare_thread;
};

LiveSession::LiveSession(LiveOptions options)
    : inner_(std::make_unique<Inner>(std::move(options))) {}
LiveSession::~LiveSession() { stop(); }

std::vector<std::string> LiveSession::warnings() const {
  return inner_->loop.live_scene().warnings();
}
Extrapolation LiveSession::extrapolation() const {
  return inner_->loop.live_scene().extrapolation();
}

void LiveSession::start() {
  inner_->ping_thread = std::thread([this] { inner_->loop.run(); });
}

void LiveSession::stop() {
  inner_->mailbox.stop();
  inner_->ring.close();
  for (std::thread* thread : {&inner_->ping_thread, &inner_->prepare_thread})
    if (thread->joinable()) thread->join();
}

std::exception_ptr LiveSession::fault() const { return inner_->mailbox.fault(); }
LineRing& LiveSession::ring() { return inner_->ring; }
void LiveSession::change(std::string_view json) { inner_->change(json); }

std::string LiveSession::truth(std::uint64_t number, std::size_t column) const {
  const auto line = inner_->ring.line(number);
  if (!line) throw std::out_of_range("this line is no longer kept");
  if (column >= line->truth.size()) throw std::out_of_range("the line has fewer columns");
  using Json = nlohmann::ordered_json;
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
                 {"grazing_deg", bin.grazing_rad / degree},
                 {"sediment", name(*line->materials, bin.sediment)},
                 {"class", name(*line->classes, bin.class_id)},
                 {"instance", bin.instance}});
  if (region == Region::shadow) json["shadow_instance"] = bin.shadow_instance;
  return json_text(json);
}

LiveSession::Watch::Watch(LiveSession& session, bool mesh) : session_(session), mesh_(mesh) {
  session_.inner_->mailbox.count_page(1, mesh_);
}
LiveSession::Watch::~Watch() { session_.inner_->mailbox.count_page(-1, mesh_); }

}  // namespace ensonify::engine
