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
  /// The control must outlive this.
  explicit RunProgress(const RunControl& control) : control_(control) {}
  void report(std::string_view stage, std::size_t done, std::size_t of) {
    const std::lock_guard lock(mutex_);
    stage_ = stage;
    done_ = done;
    of_ = of;
    call();
  }
  /// Repeats the last report, unless that was a moment ago.
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

/// A scene's run whose seafloor and track are ready. What the references name must outlive it.
struct RunState {
  const Scene& scene;
  const std::filesystem::path& folder;
  const RunControl& control;
  RunProgress& progress;
  int threads;  ///< at least 1
  RunPlan plan;
  std::optional<GeographicPlace> middle;  ///< as TrackPoses
  std::vector<std::string> warnings;      ///< about the scene and its track
  RunReport report;
  PictureTimer picture = {};

  bool picture_is_due() const { return control.growing_picture && picture.is_due(); }
};

/// Makes a run of one part: all images stay in memory until their files are written. Returns its
/// record. Throws as run().
PartRecord make_one_part(RunState& run, OutputFolder& output, Simulator& simulator,
                         const TrackPings& track);

/// Makes the missing parts of a run in several parts, or of this process's share of them, each in a
/// folder of its own, and completes the run once all are there. Returns the record of the run or of
/// the share. Throws as run().
PartRecord make_several_parts(RunState& run, OutputFolder& output, Simulator& simulator,
                              const TrackPings& track);

}  // namespace ensonify::engine
