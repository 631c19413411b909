#pragma once

#include <atomic>
#include <cstddef>
#include <filesystem>
#include <mutex>
#include <string>
#include <string_view>
#include <vector>

#include <ensonify/engine/clock.h>
#include <ensonify/engine/run.h>
#include <ensonify/engine/run/part_record.h>
#include <ensonify/engine/run/parts.h>
#include <ensonify/engine/run/run_files.h>
#include <ensonify/engine/simulator/ping_all.h>

namespace ensonify::engine {

/// When the picture of an unfinished run is due: a second after it began, and then so rarely that
/// pictures take at most a twentieth of the time.
class PictureTimer {
 public:
  bool is_due() const { return seconds_since(written_) >= std::max(1.0, 20.0 * took_s_); }
  /// To be called after a picture that was begun at this time.
  void written(Clock::time_point start) {
    took_s_ = seconds_since(start);
    written_ = Clock::now();
  }

 private:
  Clock::time_point written_ = Clock::now();  // so that a short run has none
  double took_s_ = 0.0;
};

/// A scene's run in progress, of one part or of several. Scene, folder and control must
/// outlive it.
struct RunState {
  const Scene& scene;
  const std::filesystem::path& folder;
  const RunControl& control;
  int threads;                        ///< at least 1
  std::string scene_toml;             ///< all keys, defaults included
  std::vector<std::string> warnings;  ///< about the scene and its track
  WorldOnEarth world;
  RunReport report;
  PictureTimer picture;
  /// What `progress` was called with last.
  struct Reported {
    std::mutex lock;
    std::string_view stage;
    std::size_t done = 0, of = 0;
    std::atomic<Clock::time_point> at{};
  };
  mutable Reported reported{};

  /// Throws Stopped if `progress` asks to stop.
  void report_stage(std::string_view stage, std::size_t done, std::size_t of) const;
  /// Repeats the last report, unless that was a moment ago. Any thread may call it, often. Throws
  /// Stopped, too.
  void stop_check() const;
  void report_again() const;  ///< by the thread that holds the lock
  bool picture_is_due() const { return control.growing_picture && picture.is_due(); }
  /// While each thread writes one part, which then has its neighbours, another one is pinged.
  std::size_t pings_in_memory(const RunParts& parts) const;
};

}  // namespace ensonify::engine
