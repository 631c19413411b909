#include <ensonify/engine/run.h>

#include <algorithm>
#include <chrono>
#include <map>
#include <mutex>
#include <optional>
#include <set>
#include <span>
#include <string_view>
#include <system_error>
#include <thread>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <ensonify/engine/clock.h>
#include <ensonify/engine/output/manifest.h>
#include <ensonify/engine/output/staging.h>
#include <ensonify/engine/ping_all.h>
#include <ensonify/engine/run/join.h>
#include <ensonify/engine/run/output_folder.h>
#include <ensonify/engine/run/part_record.h>
#include <ensonify/engine/run/parts.h>
#include <ensonify/engine/run/run_files.h>
#include <ensonify/engine/run/run_plan.h>
#include <ensonify/engine/run/whole_run.h>
#include <ensonify/engine/scene/reader.h>
#include <ensonify/engine/simulator_internals.h>
#include <ensonify/refine/atomic_file.h>
#include <ensonify/refine/parallel_for.h>

namespace ensonify::engine {
namespace {

namespace fs = std::filesystem;

constexpr double nominal_sound_speed_mps = 1500.0;  // for the bins of a digitiser
constexpr std::size_t max_differences = 5;          // that a message lists

/// A scene's run while it goes on.
class Run {
 public:
  Run(const Scene& scene, const fs::path& folder, const RunControl& control)
      : scene_(scene),
        output_(folder),
        folder_(folder),
        control_(control),
        threads_(refine::thread_count(control.threads)),
        scene_toml_(dump_scene(scene, false)) {}

  RunReport report() {
    Clock::time_point start = Clock::now();
    Simulator simulator(scene_,
                        {.cache = control_.cache,
                         .threads = control_.threads,
                         .progress = [&](std::string_view stage) { report_stage(stage, 0, 1); },
                         .seafloor = control_.seafloor,
                         .memory = control_.memory,
                         .more_bytes = expected_image_bytes()});
    report_.prepare_s = seconds_since(start);
    const PreparedSeafloor& prepared = SimulatorInternals::prepared(simulator);
    report_.surface = prepared.surface;
    report_.surface_why = prepared.why;
    report_.cache_file = prepared.cache_file;
    report_.cached = prepared.cached;
    const std::vector<std::string> cache_warnings = prepared.warnings;
    report_.extrapolation = {simulator.sonars(), simulator.materials(), scene_.materials};

    const TrackPings track(scene_, simulator);
    warnings_.assign(simulator.warnings().begin(), simulator.warnings().end());
    warnings_.insert(warnings_.end(), track.warnings().begin(), track.warnings().end());
    const RunParts parts = parts_of(track, simulator.sonars());
    require_images(control_.memory, simulator.sonars(), pings_in_memory(parts));
    const RunPlan plan =
        make_plan(scene_, simulator.seafloor().mesh.world_origin, control_.verify_pings, parts);
    PartRecord whole =
        parts.count() > 1 ? make_parts(simulator, track, plan) : make_one(simulator, track, plan);
    report_.counts = counts_of(whole);
    report_.verification = whole.verification;
    report_.parts = parts.count();
    for (const FileRecord& file : whole.files) report_.files.push_back(folder_ / file.name);
    report_.warnings = warnings_;
    const std::vector<std::string> more = warnings_of(whole, scene_.run.intersector);
    report_.warnings.insert(report_.warnings.end(), more.begin(), more.end());
    // Not in the manifest: the files do not depend on the cache.
    report_.warnings.insert(report_.warnings.end(), cache_warnings.begin(), cache_warnings.end());
    return std::move(report_);
  }

 private:
  void report_stage(std::string_view stage, std::size_t done, std::size_t of) {
    if (control_.progress && !control_.progress(stage, done, of))
      throw Stopped("stopped on request; the files of this run were removed");
  }

  std::size_t pings_of_a_part(std::span<const Sonar> sonars, std::size_t pings) const {
    return control_.on_outputs ? pings : pings_per_part(scene_.output, sonars, pings);
  }
  RunParts parts_of(const TrackPings& track, std::span<const Sonar> sonars) const {
    const std::size_t most = pings_of_a_part(sonars, track.count());
    return scene_.output.file_per_leg && !control_.on_outputs
               ? parts_of_legs(track.leg_starts(), track.count(), most)
               : equal_parts(track.count(), most);
  }
  /// While one part is written by each thread, another one is pinged.
  std::size_t pings_in_memory(const RunParts& parts) const {
    return std::min(parts.pings(), parts.longest() * (static_cast<std::size_t>(threads_) + 1));
  }

  /// Of the pings that are known before there is a seafloor to fly over; none otherwise. Throws
  /// MemoryError for images that do not even fit by themselves.
  double expected_image_bytes() const {
    if (scene_.track.kind != TrackKind::line) return 0.0;
    std::vector<Sonar> sonars = scene_.sonars;
    for (Sonar& sonar : sonars)
      sonar = sonar.sampled(scene_.sea.sound_speed_mps.value_or(nominal_sound_speed_mps));
    const auto pings = static_cast<std::size_t>(scene_.track.pings);
    const std::size_t at_once = pings_in_memory(equal_parts(pings, pings_of_a_part(sonars, pings)));
    require_images(control_.memory, sonars, at_once);
    return image_bytes(sonars, at_once);
  }

  /// Whether a picture of the unfinished run is to be written now: from the first block on, for a
  /// twentieth of the time at most.
  bool picture_is_due() const {
    return control_.growing_picture &&
           seconds_since(picture_written_) >= std::max(1.0, 20.0 * picture_s_);
  }

  PartRecord record_files(ScenePings& pings, const Simulator& simulator, const std::string& ending,
                          int threads, const TakeFile& take) const {
    PartRecord record =
        write_files(scene_, xxh128(scene_toml_), pings, simulator, ending, threads, take);
    if (control_.verify_pings == 0) record.verification.clear();
    record.surface = report_.surface;
    record.warnings = report_.extrapolation.behind(warnings_);
    return record;
  }

  // A run of one part: all images stay in memory until their files are written.

  PartRecord make_one(Simulator& simulator, const TrackPings& track, const RunPlan& plan) {
    if (control_.shard.count > 1)
      throw SceneError(
          "the run has one part, so there are no shares of it; set output.pings_per_file");
    if (is_run_in_parts(folder_))
      throw SceneError(
          fmt::format("{}: the folder holds a run in several parts; choose another folder with -o",
                      folder_.string()));
    Clock::time_point start = Clock::now();
    ScenePings pings;
    bool taken = false;
    ping_parts(scene_, simulator, track, threads_,
               {.next_part = [&]() -> std::optional<PingRange> {
                  if (std::exchange(taken, true)) return std::nullopt;
                  return PingRange{0, track.count()};
                },
                .finished = [&](const PingRange&, ScenePings all,
                                const Simulator&) { pings = std::move(all); },
                .after_block =
                    [&](std::span<const Waterfall> images, std::size_t done) {
                      report_stage("pings", done, track.count());
                      if (done > 0) grow_pictures(simulator, images);
                    },
                .verify_pings = control_.verify_pings});
    report_.stages = pings.stages;
    report_.pings_s = seconds_since(start);

    start = Clock::now();
    PartRecord record;
    with_memory_for("the files", [&] { record = write_one(simulator, pings, plan); });
    report_.files_s = seconds_since(start);
    report_.disk_s = output_.disk_s();
    output_.keep();
    return record;
  }

  void grow_pictures(const Simulator& simulator, std::span<const Waterfall> images) {
    if (!picture_is_due()) return;
    const Clock::time_point start = Clock::now();
    for (std::size_t i = 0; i < images.size(); ++i)
      output_.write(images[i].sonar.name + ".png", encode_picture(scene_, images[i], simulator, i));
    picture_s_ = seconds_since(start);
    picture_written_ = Clock::now();
  }

  PartRecord write_one(const Simulator& simulator, ScenePings& pings, const RunPlan& plan) {
    report_stage("files", 0, 1);
    PartRecord record =
        record_files(pings, simulator, "", threads_,
                     [&](const std::string& name, std::span<const std::byte> bytes) {
                       output_.write(name, bytes);
                     });
    if (control_.on_outputs)
      control_.on_outputs({simulator, pings.images, pings.object_visibility});
    const std::vector<std::string> more = warnings_of(record, scene_.run.intersector);
    record.warnings = report_.extrapolation.behind(joined(warnings_, more));
    record.files = output_.records();
    const std::string manifest = manifest_of(record, plan);
    output_.write("manifest.json", std::as_bytes(std::span(manifest)));
    record.files = output_.records();
    report_stage("files", 1, 1);
    return record;
  }

  static std::vector<std::string> joined(std::vector<std::string> first,
                                         const std::vector<std::string>& second) {
    first.insert(first.end(), second.begin(), second.end());
    return first;
  }

  // A run in parts.

  PartRecord make_parts(Simulator& simulator, const TrackPings& track, const RunPlan& plan) {
    const RunParts& parts = plan.parts;
    begin_folder(plan);
    output_.keep();
    find_parts(parts);
    if (control_.on_parts) control_.on_parts(size_of(simulator.sonars(), parts));
    const Clock::time_point start = Clock::now();
    try {
      while (!todo_.empty()) {
        ping_missing(simulator, track, parts);
        if (todo_.empty()) break;
        std::this_thread::sleep_for(std::chrono::milliseconds(100));  // others make these
        report_part_pings(0);
      }
    } catch (const Stopped&) {
      throw StoppedBetweenParts("stopped on request; " + left_to_do(parts));
    } catch (const std::system_error& error) {
      throw std::runtime_error(fmt::format("{}; {}", error.what(), left_to_do(parts)));
    }
    report_.pings_s = seconds_since(start);
    report_.complete = control_.shard.count == 1;
    const Clock::time_point finish_start = Clock::now();
    PartRecord whole = report_.complete ? finish_run(folder_, plan, [&] { report_part_pings(0); })
                                        : share_record(parts);
    report_.files_s += seconds_since(finish_start);
    return whole;
  }

  std::string left_to_do(const RunParts& parts) const {
    return fmt::format("{} of {} parts are finished, and the same command makes the others",
                       finished_.size(), parts.count());
  }

  /// Writes the plan, or compares with the one that is there.
  void begin_folder(const RunPlan& plan) {
    const fs::path file = plan_file(folder_);
    const Claim claim = StagingFolder::wait_for(file, [&] { report_stage("pings", 0, 1); });
    if (!fs::exists(file)) {
      if (fs::exists(folder_ / "manifest.json"))
        throw SceneError(fmt::format(
            "{}: the folder holds another run; choose another folder with -o", folder_.string()));
      refine::write_file(file, plan_json(plan));
      return;
    }
    const RunPlan before = read_plan(folder_);
    if (plan_json(before) == plan_json(plan)) return;
    std::vector<std::string> changes = differences(before, plan);
    if (changes.size() > max_differences) {
      const std::size_t more = changes.size() - max_differences;
      changes.resize(max_differences);
      changes.push_back(fmt::format("{} more", more));
    }
    throw SceneError(fmt::format(
        "{}: the folder holds parts of another run: {}; set it back, or choose another folder "
        "with -o",
        folder_.string(), fmt::join(changes, ", ")));
  }

  void find_parts(const RunParts& parts) {
    const Shard& shard = control_.shard;
    for (std::size_t part = 0; part < parts.count(); ++part) {
      const fs::path place = folder_ / parts.folder(part);
      if (fs::exists(StagingFolder::lock_of(place))) StagingFolder::try_claim(place);
      const bool wanted = part >= parts.count() * shard.index / shard.count &&
                          part < parts.count() * (shard.index + 1) / shard.count;
      if (fs::exists(place))
        finished_.insert(part);
      else if (wanted)
        todo_.push_back(part);
    }
    report_.parts_found = finished_.size();
    for (const std::size_t part : todo_) pings_to_do_ += parts.range(part).count;
  }

  RunSize size_of(std::span<const Sonar> sonars, const RunParts& parts) const {
    return {.parts = parts.count(),
            .pings = parts.pings(),
            .finished_parts = finished_.size(),
            .max_disk_bytes = image_bytes(sonars, pings_to_do_),
            .memory_bytes = image_bytes(sonars, pings_in_memory(parts))};
  }

  void report_part_pings(std::size_t more) {
    pings_done_ += more;
    report_stage("pings", pings_done_, pings_to_do_);
  }

  /// Pings the missing parts that no other process makes. Those that another one makes stay in
  /// todo_, unless it has finished them.
  void ping_missing(Simulator& simulator, const TrackPings& track, const RunParts& parts) {
    std::vector<std::size_t> elsewhere;
    std::map<std::size_t, Claim> claims;  // by the first ping
    std::mutex mutex;                     // of claims, finished_ and the pictures
    std::size_t next = 0, done_before = 0;
    ping_parts(scene_, simulator, track, threads_,
               {.next_part = [&]() -> std::optional<PingRange> {
                  while (next < todo_.size()) {
                    const std::size_t part = todo_[next++];
                    const fs::path place = folder_ / parts.folder(part);
                    std::optional<Claim> claim = StagingFolder::try_claim(place);
                    const std::lock_guard lock(mutex);
                    if (!claim) {
                      elsewhere.push_back(part);
                    } else if (fs::exists(place)) {
                      finished_.insert(part);
                    } else {
                      claims.emplace(parts.range(part).first, std::move(*claim));
                      return parts.range(part);
                    }
                  }
                  return std::nullopt;
                },
                .finished =
                    [&](const PingRange& range, ScenePings pings, const Simulator& its) {
                      const std::size_t part = parts.part_of(range.first);
                      const Clock::time_point start = Clock::now();
                      with_memory_for("the files", [&] { write_part(its, pings, parts, part); });
                      const std::lock_guard lock(mutex);
                      report_.stages += pings.stages;
                      report_.files_s += seconds_since(start);
                      claims.erase(range.first);
                      finished_.insert(part);
                      grow_joined_pictures(parts, its.sonars());
                    },
                .after_block =
                    [&](std::span<const Waterfall>, std::size_t done) {
                      report_part_pings(done - std::exchange(done_before, done));
                    },
                .verify_pings = control_.verify_pings});
    todo_ = std::move(elsewhere);
  }

  void write_part(const Simulator& simulator, ScenePings& pings, const RunParts& parts,
                  std::size_t part) {
    StagingFolder staging(folder_ / parts.folder(part));
    std::vector<FileRecord> files;
    PartRecord record =
        record_files(pings, simulator, fmt::format("_{}", parts.number(part)), 1,
                     [&](const std::string& name, std::span<const std::byte> content) {
                       refine::write_staged(staging.path() / name, content);
                       files.push_back({name, content.size(), xxh128(content)});
                     });
    pings.images.clear();
    std::ranges::sort(files, {}, &FileRecord::name);
    record.files = std::move(files);
    const std::string json = part_json(record);
    refine::write_staged(staging.path() / "part.json", std::as_bytes(std::span(json)));
    staging.put_in_place();
  }

  /// The picture of the finished parts from the first one on.
  void grow_joined_pictures(const RunParts& parts, std::span<const Sonar> sonars) {
    if (!picture_is_due() || control_.shard.count > 1) return;
    std::size_t from_first = 0;
    while (finished_.contains(from_first)) ++from_first;
    if (from_first == 0 || from_first == parts.count()) return;
    const Clock::time_point start = Clock::now();
    for (const Sonar& sonar : sonars)
      if (const std::optional<Claim> claim =
              StagingFolder::try_claim(folder_ / (sonar.name + ".png")))
        join_pictures(folder_, parts, from_first, sonar.name);
    picture_s_ = seconds_since(start);
    picture_written_ = Clock::now();
  }

  /// The counts of this share's parts.
  PartRecord share_record(const RunParts& parts) const {
    const Shard& shard = control_.shard;
    PartRecord sum{.counts = {{"pings", 0}}};  // a share may have no part
    for (std::size_t part = parts.count() * shard.index / shard.count, first = part;
         part < parts.count() * (shard.index + 1) / shard.count; ++part) {
      PartRecord record = read_part_json(folder_ / parts.folder(part) / "part.json");
      for (FileRecord& file : record.files) file.name = parts.folder(part) + "/" + file.name;
      if (part == first)
        sum = std::move(record);
      else
        sum += record;
    }
    return sum;
  }

  const Scene& scene_;
  OutputFolder output_;
  fs::path folder_;
  const RunControl& control_;
  int threads_;
  std::string scene_toml_;
  std::vector<std::string> warnings_;  // about the scene and its track
  RunReport report_;
  Clock::time_point picture_written_{};  // long ago, so that the first block shows
  double picture_s_ = 0.0;
  std::vector<std::size_t> todo_;  // parts
  std::set<std::size_t> finished_;
  std::size_t pings_to_do_ = 0;
  std::size_t pings_done_ = 0;
};

}  // namespace

RunReport run(const Scene& scene, const fs::path& folder, const RunControl& control) {
  try {
    return Run(scene, folder, control).report();
  } catch (const refine::DamagedFile& damage) {
    // Damage is found at its first touch, in the middle of the run. What was read before was sound,
    // but the whole run starts again. A file that the scene names belongs to the user: it stays.
    if (scene.seafloor.kind == SeafloorKind::progressive) throw;
    std::error_code ignored;
    fs::remove(cache_file(scene, control.cache), ignored);
    RunControl again = control;
    again.seafloor = nullptr;
    RunReport report = Run(scene, folder, again).report();
    report.warnings.push_back(fmt::format("{}; it was made again", damage.what()));
    return report;
  }
}

}  // namespace ensonify::engine
