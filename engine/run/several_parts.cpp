#include <algorithm>
#include <chrono>
#include <map>
#include <mutex>
#include <optional>
#include <set>
#include <span>
#include <system_error>
#include <thread>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <ensonify/engine/output/staging.h>
#include <ensonify/engine/run/joined_files.h>
#include <ensonify/engine/run/run_files.h>
#include <ensonify/engine/run/run_state.h>
#include <ensonify/refine/atomic_file.h>

namespace ensonify::engine {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t max_differences = 5;  // that a message lists

class SeveralParts {
 public:
  explicit SeveralParts(RunState& run) : run_(run) {}

  PartRecord make(OutputFolder& output, Simulator& simulator, const TrackPings& track) {
    begin_folder();
    output.keep();
    find_parts();
    if (run_.control.on_parts) run_.control.on_parts(size_of(simulator.sonars()));
    const Clock::time_point start = Clock::now();
    try {
      while (!todo_.empty()) {
        ping_missing(simulator, track);
        if (todo_.empty()) break;
        // Other processes make the parts in todo_.
        std::this_thread::sleep_for(std::chrono::milliseconds(100));
        report_pings(0);
      }
    } catch (const Stopped&) {
      throw StoppedBetweenParts("stopped on request; " + left_to_do());
    } catch (const std::system_error& error) {
      throw std::runtime_error(fmt::format("{}; {}", error.what(), left_to_do()));
    }
    run_.report.pings_s = seconds_since(start);
    run_.report.complete = share_.count == 1;
    const Clock::time_point finish_start = Clock::now();
    PartRecord whole = run_.report.complete
                           ? finish_run(run_.folder, plan_, [&] { report_pings(0); })
                           : sum_of_parts(run_.folder, parts_, first_, end_);
    run_.report.files_s += seconds_since(finish_start);
    return whole;
  }

 private:
  fs::path place_of(std::size_t part) const { return run_.folder / parts_.folder(part); }

  std::string left_to_do() const {
    return fmt::format("{} of {} parts are finished, and the same command makes the others",
                       finished_.size(), parts_.count());
  }

  /// Writes the plan, or compares it with the plan in the folder. Throws SceneError if they differ.
  void begin_folder() {
    const fs::path file = plan_file(run_.folder);
    const Claim claim = StagingFolder::wait_for(file, [&] { run_.progress.report("pings", 0, 1); });
    if (!fs::exists(file)) {
      const std::optional<Claim> alone =
          Claim::try_take(StagingFolder::lock_of(run_.folder / "manifest.json"));
      if (!alone || fs::exists(run_.folder / "manifest.json"))
        throw SceneError(
            fmt::format("{}: the folder holds another run; choose another folder with -o",
                        run_.folder.string()));
      require_empty_places();
      refine::write_file(file, plan_json(plan_));
      return;
    }
    const RunPlan before = read_plan(run_.folder);
    if (plan_json(before) == plan_json(plan_)) return;
    std::vector<std::string> changes = differences(before, plan_);
    if (changes.size() > max_differences) {
      const std::size_t more = changes.size() - max_differences;
      changes.resize(max_differences);
      changes.push_back(fmt::format("{} more", more));
    }
    throw SceneError(fmt::format(
        "{}: the folder holds parts of another run: {}; set it back, or choose another folder "
        "with -o",
        run_.folder.string(), fmt::join(changes, ", ")));
  }

  /// For a folder without a plan file: throws SceneError if it contains files or folders with names
  /// that this run needs. Only complete parts may belong to this run.
  void require_empty_places() const {
    std::vector<std::string> names;
    for (const Sonar& sonar : run_.scene.sonars)
      for (const char* ending : {".png", "_targets.json"}) names.push_back(sonar.name + ending);
    for (std::size_t part = 0; part < parts_.count(); ++part)
      if (fs::exists(place_of(part)) && !is_whole(part)) names.push_back(parts_.folder(part));
    require_none_of(run_.folder, names);
  }

  /// Throws SceneError unless a part's place is a folder with only files of that part.
  void require_own_files(std::size_t part) const {
    const fs::path place = place_of(part);
    std::vector<std::string> own =
        file_names(run_.scene, "_" + parts_.number(part), parts_.range(part));
    own.emplace_back(part_json_name);
    const auto refuse = [](const fs::path& foreign) {
      throw SceneError(fmt::format(
          "{}: is not of this run, but its place is needed for a part that must be made; move it "
          "away, or choose another folder with -o",
          foreign.string()));
    };
    if (!fs::is_directory(place)) refuse(place);
    for (const fs::directory_entry& entry : fs::directory_iterator(place))
      if (entry.is_directory() ||
          std::ranges::find(own, entry.path().filename().string()) == own.end())
        refuse(entry.path());
  }

  void find_parts() {
    const std::set<std::string> with_remains = StagingFolder::places_with_remains(run_.folder);
    for (std::size_t part = 0; part < parts_.count(); ++part) {
      const fs::path place = place_of(part);
      if (with_remains.contains(parts_.folder(part))) StagingFolder::try_claim(place);
      if (fs::exists(place) && !is_whole(part)) {
        require_own_files(part);
        fs::remove_all(place);
      }
      if (fs::exists(place))
        finished_.insert(part);
      else if (part >= first_ && part < end_)
        todo_.push_back(part);
    }
    run_.report.parts_found = finished_.size();
    for (const std::size_t part : todo_) pings_to_do_ += parts_.range(part).count;
  }

  /// Whether a part's folder has all files of that part of this run, with the recorded sizes.
  /// (`merge` compares the hashes.)
  bool is_whole(std::size_t part) const {
    const fs::path place = place_of(part);
    if (!fs::exists(place / part_json_name)) return false;
    try {
      const PartRecord record = read_part_json(place / part_json_name);
      return record.run_xxh128 == plan_xxh128_ && record.pings.first == parts_.range(part).first &&
             !record.files.empty() &&
             std::ranges::all_of(record.files, [&](const FileRecord& file) {
               return fs::exists(place / file.name) &&
                      fs::file_size(place / file.name) == file.size_bytes;
             });
    } catch (const Error&) {
      return false;  // the record is damaged
    }
  }

  RunSize size_of(std::span<const Sonar> sonars) const {
    return {.parts = parts_.count(),
            .pings = parts_.pings(),
            .finished_parts = finished_.size(),
            .max_disk_bytes = most_file_bytes(run_.scene, sonars, pings_to_do_, todo_.size()),
            .memory_bytes = image_bytes(sonars, pings_in_memory(run_.scene, parts_, run_.threads))};
  }

  void report_pings(std::size_t more) {
    pings_done_ += more;
    run_.progress.report("pings", pings_done_, pings_to_do_);
  }

  /// Pings the parts in todo_. A part that another process is making stays in todo_.
  void ping_missing(Simulator& simulator, const TrackPings& track) {
    std::vector<std::size_t> elsewhere;
    std::map<std::size_t, Claim> claims;  // by the first ping
    std::mutex mutex;                     // guards claims, finished_ and the pictures
    std::size_t next = 0, done_before = 0;
    const auto next_part = [&]() -> std::optional<PingRange> {
      while (next < todo_.size()) {
        const std::size_t part = todo_[next++];
        const fs::path place = place_of(part);
        std::optional<Claim> claim = StagingFolder::try_claim(place);
        const std::lock_guard lock(mutex);
        if (!claim) {
          elsewhere.push_back(part);
        } else if (fs::exists(place)) {
          finished_.insert(part);
        } else {
          claims.emplace(parts_.range(part).first, std::move(*claim));
          return parts_.range(part);
        }
      }
      return std::nullopt;
    };
    const auto finished = [&](const PingRange& range, ScenePings pings, const Simulator& its) {
      const std::size_t part = parts_.part_of(range.first);
      const Clock::time_point start = Clock::now();
      with_memory_for("the files", [&] { write_part(its, pings, part); });
      const std::lock_guard lock(mutex);
      run_.report.stages += pings.stages;
      run_.report.files_s += seconds_since(start);
      claims.erase(range.first);
      finished_.insert(part);
      grow_joined_pictures(its.sonars());
    };
    const auto after_block = [&](std::span<const Waterfall>, std::size_t done) {
      report_pings(done - std::exchange(done_before, done));
    };
    ping_parts(run_.scene, simulator, track, run_.threads,
               {next_part, finished, after_block, run_.control.verify_pings});
    todo_ = std::move(elsewhere);
  }

  void write_part(const Simulator& simulator, ScenePings& pings, std::size_t part) {
    StagingFolder staging(place_of(part));
    OutputFolder output(staging.path(), true);
    PartRecord record =
        write_files(run_, pings, simulator, "_" + parts_.number(part), 1, output).record;
    pings.images.clear();
    pings.neighbours.clear();
    record.files = output.records();
    record.run_xxh128 = plan_xxh128_;
    output.write(part_json_name, part_json(record));
    output.keep();
    staging.put_in_place();
  }

  /// Joins the pictures of the parts before the first unfinished part.
  void grow_joined_pictures(std::span<const Sonar> sonars) {
    if (!run_.pictures_are_due() || share_.count > 1) return;
    std::size_t from_first = 0;
    while (finished_.contains(from_first)) ++from_first;
    if (from_first == 0 || from_first == parts_.count()) return;
    const Clock::time_point start = Clock::now();
    for (const Sonar& sonar : sonars)
      if (const std::optional<Claim> claim =
              StagingFolder::try_claim(run_.folder / (sonar.name + ".png")))
        join_pictures(run_.folder, parts_, from_first, sonar.name);
    run_.wrote_pictures(start);
  }

  RunState& run_;
  const RunPlan& plan_ = run_.plan;
  const std::string plan_xxh128_ = hash_of(plan_);
  const RunParts& parts_ = plan_.parts;
  const Shard& share_ = run_.control.shard;
  const std::size_t first_ = share_.begin(parts_.count()), end_ = share_.end(parts_.count());
  std::vector<std::size_t> todo_;  // parts of the share that are not finished
  std::set<std::size_t> finished_;
  std::size_t pings_to_do_ = 0;
  std::size_t pings_done_ = 0;
};

}  // namespace

PartRecord make_several_parts(RunState& run, OutputFolder& output, Simulator& simulator,
                              const TrackPings& track) {
  return SeveralParts(run).make(output, simulator, track);
}

}  // namespace ensonify::engine
