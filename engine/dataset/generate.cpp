#include <ensonify/engine/dataset/generate.h>

#include <algorithm>
#include <chrono>
#include <exception>
#include <memory>
#include <mutex>
#include <optional>
#include <set>
#include <system_error>
#include <thread>

#include <fmt/format.h>

#include <ensonify/engine/base/clock.h>
#include <ensonify/engine/dataset/dataset_json.h>
#include <ensonify/engine/dataset/products.h>
#include <ensonify/engine/output/staging.h>
#include <ensonify/engine/output/tar.h>
#include <ensonify/engine/scene/dump.h>
#include <ensonify/engine/scene/keys/schema.h>
#include <ensonify/engine/scene/scene_paths.h>
#include <ensonify/engine/seafloor/bed/survey.h>
#include <ensonify/engine/simulator/prepare.h>
#include <ensonify/refine/atomic_file.h>
#include <ensonify/refine/parallel_for.h>
#include <ensonify/refine/read_file.h>
#include <ensonify/refine/standard_floats.h>
#include <ensonify/refine/triangle_mesh.h>

namespace ensonify::engine {
namespace {

namespace fs = std::filesystem;

struct Interval {
  std::size_t begin = 0, end = 0;
};

std::size_t tar_size(const Recipe& recipe) {
  return static_cast<std::size_t>(std::max(1, recipe.options().samples_per_tar));
}

/// The tars of a shard, or the samples if there are no tars.
Interval units_of(const Recipe& recipe, const Shard& shard) {
  const std::size_t units = (recipe.samples() + tar_size(recipe) - 1) / tar_size(recipe);
  return {shard.begin(units), shard.end(units)};
}
Interval samples_of(const Recipe& recipe, const Interval& units) {
  return {units.begin * tar_size(recipe), std::min(recipe.samples(), units.end * tar_size(recipe))};
}

/// Whether a sample is made, in its folder or in a tar. Throws as is_whole_sample().
bool is_made(const SampleFolders& folders, std::size_t sample, const std::string& dataset_xxh128) {
  const fs::path folder = folders.sample(sample);
  try {
    if (fs::exists(folder)) return is_whole_sample(folder, sample, dataset_xxh128);
  } catch (const SceneError&) {
    // Another process may have put the sample into a tar meanwhile, and removed its folder.
    if (fs::exists(folder)) throw;
  }
  return folders.finished(sample);
}

/// For each of these samples, whether is_made(). Calls on_sample(), which may throw, before each.
template <class OnSample>
std::vector<char> are_made(const SampleFolders& folders, const Interval& samples,
                           const std::string& dataset_json, int threads, OnSample&& on_sample) {
  const std::string hash = hash_in(dataset_json);
  std::vector<char> made(samples.end - samples.begin);
  refine::parallel_for(made.size(), threads, [&](std::size_t i, int) {
    on_sample();
    made[i] = is_made(folders, samples.begin + i, hash);
  });
  return made;
}

std::string without_numbers(std::string text) {
  std::erase_if(text, [](char c) { return c >= '0' && c <= '9'; });
  return text;
}

void stage(const fs::path& file, const std::string& text) {
  refine::write_staged(file, std::as_bytes(std::span(text)));
}

void stage_copy(const fs::path& file, const fs::path& copy) {
  fs::create_directories(copy.parent_path());
  stage(copy, refine::read_file(file));
}

/// `copy` is the copy of a scene's file. Throws SceneError unless `copies` are the files that are
/// read together with `copy` (files_behind()). Only then does reading the copy give the same as
/// reading the original. The files differ if a mosaic names its sources by absolute paths, or if
/// the scene names a link whose name is not that of its file, because the files next to it have the
/// name of the file.
void require_read_with(const std::vector<fs::path>& copies, const fs::path& copy,
                       std::string_view key, const InputFile& file) {
  try {
    if (files_behind(copy) == copies) return;
  } catch (const refine::MeshError&) {  // the mosaic would not find its sources
  }
  throw SceneError(fmt::format(
      "'{}' names {}, whose copy in a sample would not find the other files that belong to it; use "
      "paths relative to the mosaic in it, and links that have the names of their files",
      key, file.name));
}

/// Copies the files that a scene names by relative paths, and the files behind them, to a folder,
/// so that the scene in this folder finds them.
void stage_files(const Scene& scene, const fs::path& folder) {
  for_each_file(scene, [&](std::string_view key, const InputFile& file) {
    if (file.name.empty() || file.name.starts_with(data_prefix)) return;
    const fs::path copy = fs::absolute(folder / file.name).lexically_normal();
    stage_copy(file.path, copy);
    const fs::path its_folder = fs::absolute(file.path).lexically_normal().parent_path();
    std::vector<fs::path> copies;
    for (const fs::path& behind : files_behind(file.path)) {
      copies.push_back(copy.parent_path() / behind.lexically_relative(its_folder));
      stage_copy(behind, copies.back());
    }
    if (!copies.empty()) require_read_with(copies, copy, key, file);
  });
}

/// Assigns samples to workers so that two workers rarely need the same seafloor at the same time. A
/// worker first makes all samples of its seafloor, then takes a seafloor that no worker has begun.
/// If there is none, it takes samples of another worker's seafloor.
class Schedule {
 public:
  explicit Schedule(const std::map<std::size_t, std::vector<std::size_t>>& samples_by_seafloor) {
    for (const auto& [seafloor, samples] : samples_by_seafloor)
      open_[seafloor] = {samples.rbegin(), samples.rend()};
  }
  std::optional<std::size_t> next(std::optional<std::size_t>& seafloor) {
    const std::lock_guard lock(mutex_);
    if (!seafloor || !open_.contains(*seafloor)) {
      const auto untouched =
          std::ranges::find_if(open_, [&](const auto& s) { return !begun_.contains(s.first); });
      const auto chosen = untouched != open_.end() ? untouched : open_.begin();
      if (chosen == open_.end()) return std::nullopt;
      seafloor = chosen->first;
      begun_.insert(*seafloor);
    }
    std::vector<std::size_t>& left = open_[*seafloor];
    const std::size_t sample = left.back();
    left.pop_back();
    if (left.empty()) open_.erase(*seafloor);
    return sample;
  }

 private:
  std::mutex mutex_;
  std::map<std::size_t, std::vector<std::size_t>> open_;  // by seafloor; taken from the back
  std::set<std::size_t> begun_;
};

/// The prepared seafloors that workers use. A seafloor is freed when no worker uses it.
class Seafloors {
 public:
  using Pointer = std::shared_ptr<const PreparedSeafloor>;

  /// Prepares seafloor `number`, or waits while another worker prepares it.
  Pointer get(std::size_t number, const Scene& scene, const Preparation& how) {
    Place& place = place_of(number);
    const std::lock_guard lock(place.mutex);
    std::weak_ptr<const PreparedSeafloor>& known = place.prepared[preparation_key(scene)];
    Pointer prepared = known.lock();
    if (!prepared) known = prepared = prepare_seafloor(scene, how);
    return prepared;
  }

 private:
  struct Place {
    std::mutex mutex;
    std::map<PreparationKey, std::weak_ptr<const PreparedSeafloor>> prepared;
  };
  Place& place_of(std::size_t number) {
    const std::lock_guard lock(mutex_);
    return places_[number];
  }
  std::mutex mutex_;
  std::map<std::size_t, Place> places_;  // a place stays where it is when others are added
};

class Generator {
 public:
  Generator(const Recipe& recipe, const fs::path& folder, const GenerateControl& control)
      : recipe_(recipe),
        control_(control),
        folders_(folder, static_cast<std::size_t>(recipe.options().samples_per_tar)),
        units_(units_of(recipe, control.shard)),
        samples_(samples_of(recipe, units_)),
        dataset_json_(dataset_json(recipe)) {}

  GenerateReport generate_all() {
    const Clock::time_point start = Clock::now();
    try {
      begin();
      work();
      wait_for_others();
      make_tars();
    } catch (const Stopped&) {
      report_.stopped = true;
    }
    report_.wall_s = seconds_since(start);
    return std::move(report_);
  }

 private:
  bool in_tars() const { return recipe_.options().samples_per_tar > 0; }

  void begin() {
    refine::make_folder(folders_.dataset() / "samples");
    if (in_tars()) refine::make_folder(folders_.dataset() / "tars");
    const fs::path file = folders_.dataset() / "dataset.json";
    {
      const Claim claim = wait_for(file);
      if (!fs::exists(file)) refine::write_file(file, dataset_json_);
    }
    require_same_dataset(file, dataset_json_);
    report_.samples = samples_.end - samples_.begin;
    const std::vector<char> made =
        are_made(folders_, samples_, dataset_json_, refine::thread_count(control_.threads),
                 [&] { report_progress(); });
    const std::set<std::string> with_remains =
        StagingFolder::places_with_remains(folders_.dataset() / "samples");
    for (std::size_t sample = samples_.begin; sample < samples_.end; ++sample) {
      if (with_remains.contains(SampleFolders::name_of(sample)))
        StagingFolder::try_claim(folders_.sample(sample));
      if (made[sample - samples_.begin])
        ++report_.found;
      else
        todo_[recipe_.seafloor_of(sample)].push_back(sample);
    }
    done_ = report_.found;
    report_progress();
  }

  Claim wait_for(const fs::path& place) {
    return StagingFolder::wait_for(place, [&] { report_progress(); });
  }

  void report_progress() {
    const std::lock_guard lock(mutex_);
    if (!stop_ && control_.progress && !control_.progress(done_, report_.samples)) stop_ = true;
    if (stop_) throw Stopped("stopped on request");
  }

  void work() {
    std::size_t todo = 0;
    for (const auto& [seafloor, samples] : todo_) todo += samples.size();
    if (todo == 0) return;
    const auto threads = static_cast<std::size_t>(refine::thread_count(control_.threads));
    const std::size_t workers = std::min(threads, todo);
    threads_each_ = static_cast<int>(threads / workers);
    memory_each_.bytes = control_.memory.bytes / static_cast<double>(workers);
    Schedule schedule(todo_);
    refine::parallel_for(workers, static_cast<int>(workers), [&](std::size_t, int) {
      std::optional<std::size_t> seafloor;
      Seafloors::Pointer kept;  // the seafloor of the last sample, perhaps also of the next one
      while (const auto sample = schedule.next(seafloor)) do_sample(*sample, kept);
    });
  }

  /// Waits for the samples that other processes have claimed, and makes those that they leave.
  void wait_for_others() {
    using namespace std::chrono_literals;
    while (!others_.empty()) {
      const Clock::time_point start = Clock::now();
      std::this_thread::sleep_for(100ms);
      const std::vector<std::size_t> waiting = std::exchange(others_, {});
      report_.stages_s["wait"] += seconds_since(start);
      Seafloors::Pointer kept;
      for (const std::size_t sample : waiting) do_sample(sample, kept);
      report_progress();
    }
  }

  void do_sample(std::size_t sample, Seafloors::Pointer& kept) {
    report_progress();
    std::map<std::string, double> stages_s;
    std::string failure;
    bool claimed_elsewhere = false;
    try {
      const fs::path place = folders_.sample(sample);
      const std::optional<Claim> claim = StagingFolder::try_claim(place);
      if (!claim) {
        claimed_elsewhere = true;
      } else if (!is_made(folders_, sample, hash_in(dataset_json_))) {
        if (fs::exists(place)) discard(place, place);
        make_sample(sample, place, kept, stages_s);
      }
    } catch (const Stopped&) {
      throw;
    } catch (const std::system_error&) {
      const std::lock_guard lock(mutex_);
      stop_ = true;  // the disk would refuse the other samples too
      throw;
    } catch (const std::bad_alloc&) {
      failure = "out of memory while making its products; use fewer threads";
    } catch (const std::exception& error) {
      failure = error.what();
    }
    const std::lock_guard lock(mutex_);
    for (const auto& [stage, seconds] : stages_s) report_.stages_s[stage] += seconds;
    if (claimed_elsewhere) {
      others_.push_back(sample);
    } else if (!failure.empty()) {
      report_.failed[sample] = failure;
      if (control_.failed) control_.failed(sample, failure);
    } else {
      ++done_;
      // Without stages, another process made it meanwhile.
      ++(stages_s.empty() ? report_.found : report_.made);
    }
  }

  /// Removes a sample's folder in one step, so that no process ever sees a part of it. This process
  /// must have claimed `place`. The next process that claims it removes what is left.
  static void discard(const fs::path& folder, const fs::path& place) {
    const StagingFolder staging(place);
    fs::rename(folder, staging.path() / folder.filename());
  }

  void make_sample(std::size_t number, const fs::path& place, Seafloors::Pointer& kept,
                   std::map<std::string, double>& stages_s) {
    std::string current;
    Clock::time_point since = Clock::now();
    // Adds the time since the last call to the current stage, then begins the next stage.
    const auto enter = [&](std::string_view next) {
      if (!current.empty()) stages_s[current] += seconds_since(since);
      since = Clock::now();
      current = next;
    };
    enter("recipe");
    const SampleScene sample = recipe_.sample(number);
    StagingFolder staging(place);
    const auto on_stage = [&](std::string_view name) {
      enter(name);
      report_progress();
    };
    enter("wait");
    Seafloors::Pointer before = std::exchange(kept, nullptr);
    kept = seafloors_.get(sample.seafloor, sample.scene,
                          {.cache = control_.cache,
                           .threads = threads_each_,
                           .progress = on_stage,
                           .stop_check = [this] { report_progress(); },
                           .memory = memory_each_});
    before.reset();
    enter("tree");

    std::string_view running;
    const auto on_progress = [&](std::string_view now, std::size_t, std::size_t) {
      if (now != running)
        enter((running = now) == "pings" ? "ping" : now == "files" ? "encode" : "tree");
      report_progress();
      return true;
    };
    double products_disk_s = 0.0;
    const auto on_outputs = [&](const RunOutputs& outputs) {
      products_disk_s = write_products(recipe_.options(), sample, outputs, staging.path(),
                                       {control_.memory, [this] { report_progress(); }});
    };
    const RunReport run_report = run(sample.scene, staging.path(),
                                     {.threads = threads_each_,
                                      .progress = on_progress,
                                      .cache = control_.cache,
                                      .seafloor = kept,
                                      .memory = memory_each_,
                                      .growing_picture = false,
                                      .staged = true,
                                      .on_outputs = on_outputs});
    enter("disk");
    stage(staging.path() / "scene.toml", dump_scene(sample.scene, false));
    stage_files(sample.scene, staging.path());
    stage(staging.path() / "sample.json",
          sample_json(number, sample, dataset_json_, staging.path()));
    staging.put_in_place();
    enter("");
    const double disk_s = run_report.disk_s + products_disk_s;
    stages_s["encode"] -= disk_s;
    stages_s["disk"] += disk_s;
    const std::lock_guard lock(mutex_);
    for (const std::string& warning : run_report.warnings)
      if (warned_.insert(without_numbers(warning)).second) report_.warnings.push_back(warning);
    report_.extrapolation += run_report.extrapolation;
  }

  /// Replaces the folders of samples by a tar wherever all samples of the tar are finished.
  void make_tars() {
    if (!in_tars()) return;
    const Clock::time_point start = Clock::now();
    for (std::size_t unit = units_.begin; unit < units_.end; ++unit) {
      report_progress();
      const Interval samples = samples_of(recipe_, {unit, unit + 1});
      const fs::path place = folders_.tar(unit);
      const Claim claim = wait_for(place);
      if (!is_whole_tar(place)) make_tar(samples, place);
      if (!is_whole_tar(place)) continue;
      for (std::size_t sample = samples.begin; sample < samples.end; ++sample)
        if (const fs::path folder = folders_.sample(sample); fs::exists(folder))
          discard(folder, place);
    }
    report_.stages_s["disk"] += seconds_since(start);
  }

  void make_tar(const Interval& samples, const fs::path& place) {
    for (std::size_t sample = samples.begin; sample < samples.end; ++sample)
      if (!fs::exists(folders_.sample(sample))) return;  // it failed
    TarFile tar(place);
    for (std::size_t sample = samples.begin; sample < samples.end; ++sample) {
      const fs::path folder = folders_.sample(sample);
      std::map<std::string, fs::path> files;
      for (const fs::directory_entry& entry : fs::recursive_directory_iterator(folder))
        if (entry.is_regular_file())
          files[SampleFolders::name_in_tar(
              sample, entry.path().lexically_relative(folder).string())] = entry.path();
      for (const auto& [name, file] : files) {
        const std::string content = refine::read_file(file);
        tar.add(name, std::as_bytes(std::span(content)));
      }
      report_progress();
    }
    tar.finish();
  }

  const Recipe& recipe_;
  const GenerateControl& control_;
  SampleFolders folders_;
  Interval units_, samples_;
  const std::string dataset_json_;
  GenerateReport report_;
  // Warnings without their digits: those that differ only in numbers are reported once.
  std::set<std::string> warned_;
  std::map<std::size_t, std::vector<std::size_t>> todo_;  // by seafloor
  Seafloors seafloors_;
  int threads_each_ = 1;
  MemoryLimit memory_each_;
  std::mutex mutex_;  // guards the members below, report_ and warned_
  std::vector<std::size_t> others_;
  std::size_t done_ = 0;
  bool stop_ = false;
};

}  // namespace

GenerateReport generate(const Recipe& recipe, const fs::path& folder,
                        const GenerateControl& control) {
  const refine::StandardFloats floats;
  if (control.shard.count == 0 || control.shard.index >= control.shard.count)
    throw std::invalid_argument(fmt::format("generate: no shard {}/{}; shards count from 0/{}",
                                            control.shard.index, control.shard.count,
                                            control.shard.count));
  return Generator(recipe, folder, control).generate_all();
}

ShardState shard_state(const Recipe& recipe, const fs::path& folder, const Shard& shard) {
  const SampleFolders folders(folder, static_cast<std::size_t>(recipe.options().samples_per_tar));
  const Interval samples = samples_of(recipe, units_of(recipe, shard));
  ShardState state{.samples = samples.end - samples.begin};
  const fs::path file = folder / "dataset.json";
  if (fs::exists(file)) require_same_dataset(file, dataset_json(recipe));
  for (const char made :
       are_made(folders, samples, dataset_json(recipe), refine::thread_count(0), [] {}))
    state.finished += static_cast<std::size_t>(made);
  return state;
}

}  // namespace ensonify::engine
