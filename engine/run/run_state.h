#pragma once

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <filesystem>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <ensonify/engine/base/clock.h>
#include <ensonify/engine/run/output_folder.h>
#include <ensonify/engine/run/part_record.h>
#include <ensonify/engine/run/run_control.h>
#include <ensonify/engine/run/run_plan.h>
#include <ensonify/engine/seafloor/bed/geographic.h>
#include <ensonify/engine/simulator/ping_all.h>

namespace ensonify::engine {

/// Calls RunControl::progress. Any thread may call it. Throws Stopped if the caller asks to stop.
class RunProgress {
 public:
  /// The control must outlive this object.
  explicit RunProgress(const RunControl& control) : control_(control) {}
  void report(std::string_view stage, std::size_t done, std::size_t of) {
    const std::lock_guard lock(mutex_);
    stage_ = stage;
    done_ = done;
    of_ = of;
    call();
  }
  /// Repeats the last report, unless that was less than 0.1 s ago.
  void repeat() {
    if (seconds_since(called_) < 0.1) return;
    const std::lock_guard lock(mutex_);
    call();
  }

 private:
  void call() {
    called_ = Clock::now();
    if (control_.progress && !control_.progress(stage_, done_, of_))
      throw Stopped("stopped on request; the files of this run were removed");
  }

  const RunControl& control_;
  std::mutex mutex_;
  std::string_view stage_;
  std::size_t done_ = 0, of_ = 0;
  std::atomic<Clock::time_point> called_{};
};

/// A scene's run whose seafloor and track are ready. The referenced objects must outlive it.
struct RunState {
  const Scene& scene;
  const std::filesystem::path& folder;
  const RunControl& control;
  RunProgress& progress;
  int threads;  ///< at least 1
  RunPlan plan;
  std::optional<GeographicPlace> middle;  ///< as in TrackPoses
  std::vector<std::string> warnings;      ///< about the scene and its track
  RunReport report;
  Clock::time_point pictures_written = Clock::now();  ///< at first the start of the run
  double pictures_took_s = 0.0;

  /// Pictures of an unfinished run are due 1 s after its start, and then so rarely that writing
  /// them takes at most 1/20 of the time.
  bool pictures_are_due() const {
    return control.growing_picture &&
           seconds_since(pictures_written) >= std::max(1.0, 20.0 * pictures_took_s);
  }
  /// Call this when the pictures are written. `start` is when their writing began.
  void wrote_pictures(Clock::time_point start) {
    pictures_took_s = seconds_since(start);
    pictures_written = Clock::now();
  }
};

/// Makes a run of one part: all images stay in memory until their files are written. Returns the
/// run's record. Throws as run().
PartRecord make_one_part(RunState& run, OutputFolder& output, Simulator& simulator,
                         const TrackPings& track);

/// Makes the missing parts of a run in several parts, each in a separate folder, or only those in
/// this process's share. If the share is the whole run, also writes the run's joined files. Returns
/// the record of the run or of the share. Throws as run().
PartRecord make_several_parts(RunState& run, OutputFolder& output, Simulator& simulator,
                              const TrackPings& track);

}  // namespace ensonify::engine
