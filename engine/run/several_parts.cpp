#include <ensonify/engine/run/several_parts.h>

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
#include <ensonify/engine/run/join_pictures.h>
#include <ensonify/engine/run/whole_run.h>
#include <ensonify/refine/atomic_file.h>

namespace ensonify::engine {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t max_differences = 5;  // that a message lists

class SeveralParts {
 public:
  SeveralParts(RunState& run, const RunPlan& plan) : run_(run), plan_(plan), parts_(plan.parts) {}

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
        std::this_thread::sleep_for(std::chrono::milliseconds(100));  // others make these
        report_pings(0);
      }
    } catch (const Stopped&) {
      throw StoppedBetweenParts("stopped on request; " + left_to_do());
    } catch (const std::system_error& error) {
      throw std::runtime_error(fmt::format("{}; {}", error.what(), left_to_do()));
    }
    run_.report.pings_s = seconds_since(start);
    run_.report.complete = run_.control.shard.count == 1;
    const Clock::time_point finish_start = Clock::now();
    PartRecord whole = run_.report.complete
                           ? finish_run(run_.folder, plan_, [&] { report_pings(0); })
                           : share_record();
    run_.report.files_s += seconds_since(finish_start);
    return whole;
  }

 private:
  std::string left_to_do() const {
    return fmt::format("{} of {} parts are finished, and the same command makes the others",
                       finished_.size(), parts_.count());
  }

  /// Writes the plan, or compares with the one that is there.
  void begin_folder() {
    const fs::path file = plan_file(run_.folder);
    const Claim claim = StagingFolder::wait_for(file, [&] { run_.report_stage("pings", 0, 1); });
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

  /// Throws SceneError if the folder has files in the way. Without a plan file, only complete parts
  /// can belong to this run.
  void require_empty_places() const {
    std::vector<std::string> names;
    for (const Sonar& sonar : run_.scene.sonars)
      for (const char* ending : {".png", "_targets.json"}) names.push_back(sonar.name + ending);
    for (std::size_t part = 0; part < parts_.count(); ++part)
      if (fs::exists(run_.folder / parts_.folder(part)) && !is_whole(part))
        names.push_back(parts_.folder(part));
    require_none_of(run_.folder, names);
  }

  /// Throws SceneError if a part's place is not a folder with nothing but files of that part.
  void require_own_files(std::size_t part) const {
    const fs::path place = run_.folder / parts_.folder(part);
    std::vector<std::string> own = file_names(run_.scene, "_" + parts_.number(part));
    own.emplace_back("part.json");
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
    const Shard& share = run_.control.shard;
    const std::set<std::string> with_remains = StagingFolder::places_with_remains(run_.folder);
    for (std::size_t part = 0; part < parts_.count(); ++part) {
      const fs::path place = run_.folder / parts_.folder(part);
      if (with_remains.contains(parts_.folder(part))) StagingFolder::try_claim(place);
      if (fs::exists(place) && !is_whole(part)) {
        require_own_files(part);
        fs::remove_all(place);
      }
      if (fs::exists(place))
        finished_.insert(part);
      else if (part >= share.begin(parts_.count()) && part < share.end(parts_.count()))
        todo_.push_back(part);
    }
    run_.report.parts_found = finished_.size();
    for (const std::size_t part : todo_) pings_to_do_ += parts_.range(part).count;
  }

  /// Whether all files of a part of this run are there, with their sizes. (`merge` compares their
  /// hashes.)
  bool is_whole(std::size_t part) const {
    const fs::path place = run_.folder / parts_.folder(part);
    try {
      const PartRecord record = read_part_json(place / "part.json");
      return record.run_xxh128 == hash_of(plan_) &&
             record.pings.first == parts_.range(part).first && !record.files.empty() &&
             std::ranges::all_of(record.files, [&](const FileRecord& file) {
               return fs::file_size(place / file.name) == file.size_bytes;
             });
    } catch (const std::system_error& error) {
      if (error.code() != std::errc::no_such_file_or_directory &&
          error.code() != std::errc::not_a_directory)
        throw;
    } catch (const std::runtime_error&) {
      // The record is damaged.
    }
    return false;
  }

  RunSize size_of(std::span<const Sonar> sonars) const {
    return {.parts = parts_.count(),
            .pings = parts_.pings(),
            .finished_parts = finished_.size(),
            .max_disk_bytes = most_file_bytes(run_.scene, sonars, pings_to_do_, todo_.size()),
            .memory_bytes = image_bytes(sonars, run_.pings_in_memory(parts_))};
  }

  void report_pings(std::size_t more) {
    pings_done_ += more;
    run_.report_stage("pings", pings_done_, pings_to_do_);
  }

  /// Pings the missing parts that no other process makes. Those that another one makes stay in
  /// todo_, unless it has finished them.
  void ping_missing(Simulator& simulator, const TrackPings& track) {
    std::vector<std::size_t> elsewhere;
    std::map<std::size_t, Claim> claims;  // by the first ping
    std::mutex mutex;                     // of claims, finished_ and the pictures
    std::size_t next = 0, done_before = 0;
    ping_parts(run_.scene, simulator, track, run_.threads,
               {.next_part = [&]() -> std::optional<PingRange> {
                  while (next < todo_.size()) {
                    const std::size_t part = todo_[next++];
                    const fs::path place = run_.folder / parts_.folder(part);
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
                },
                .finished =
                    [&](const PingRange& range, ScenePings pings, const Simulator& its) {
                      const std::size_t part = parts_.part_of(range.first);
                      const Clock::time_point start = Clock::now();
                      with_memory_for("the files", [&] { write_part(its, pings, part); });
                      const std::lock_guard lock(mutex);
                      run_.report.stages += pings.stages;
                      run_.report.files_s += seconds_since(start);
                      claims.erase(range.first);
                      finished_.insert(part);
                      grow_joined_pictures(its.sonars());
                    },
                .after_block =
                    [&](std::span<const Waterfall>, std::size_t done) {
                      report_pings(done - std::exchange(done_before, done));
                    },
                .verify_pings = run_.control.verify_pings});
    todo_ = std::move(elsewhere);
  }

  void write_part(const Simulator& simulator, ScenePings& pings, std::size_t part) {
    StagingFolder staging(run_.folder / parts_.folder(part));
    std::vector<FileRecord> files;
    PartRecord record = write_files(
        run_, pings, simulator, fmt::format("_{}", parts_.number(part)), 1,
        [&](const std::string& name, const refine::WriteContent& write_content) {
          refine::write_staged(
              staging.path() / name, write_content,
              [&](const refine::ReadAt& read_at) { files.push_back(record_of(name, read_at)); });
        });
    pings.images.clear();
    pings.neighbours.clear();
    std::ranges::sort(files, {}, &FileRecord::name);
    record.files = std::move(files);
    record.run_xxh128 = hash_of(plan_);
    const std::string json = part_json(record);
    refine::write_staged(staging.path() / "part.json", std::as_bytes(std::span(json)));
    staging.put_in_place();
  }

  /// The picture of the finished parts from the first one on.
  void grow_joined_pictures(std::span<const Sonar> sonars) {
    if (!run_.picture_is_due() || run_.control.shard.count > 1) return;
    std::size_t from_first = 0;
    while (finished_.contains(from_first)) ++from_first;
    if (from_first == 0 || from_first == parts_.count()) return;
    const Clock::time_point start = Clock::now();
    for (const Sonar& sonar : sonars)
      if (const std::optional<Claim> claim =
              StagingFolder::try_claim(run_.folder / (sonar.name + ".png")))
        join_pictures(run_.folder, parts_, from_first, sonar.name);
    run_.picture.written(start);
  }

  /// The counts of this share's parts.
  PartRecord share_record() const {
    const Shard& share = run_.control.shard;
    return sum_of_parts(run_.folder, parts_, share.begin(parts_.count()),
                        share.end(parts_.count()));
  }

  RunState& run_;
  const RunPlan& plan_;
  const RunParts& parts_;
  std::vector<std::size_t> todo_;  // parts
  std::set<std::size_t> finished_;
  std::size_t pings_to_do_ = 0;
  std::size_t pings_done_ = 0;
};

}  // namespace

PartRecord make_several_parts(RunState& run, OutputFolder& output, Simulator& simulator,
                              const TrackPings& track, const RunPlan& plan) {
  return SeveralParts(run, plan).make(output, simulator, track);
}

}  // namespace ensonify::engine
