#include <ensonify/engine/run.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <map>
#include <mutex>
#include <optional>
#include <shared_mutex>
#include <span>
#include <string_view>

#include <fmt/format.h>

#include <ensonify/engine/image/display.h>
#include <ensonify/engine/image/truth.h>
#include <ensonify/engine/image/waterfall.h>
#include <ensonify/engine/output/exr.h>
#include <ensonify/engine/output/jsf.h>
#include <ensonify/engine/output/manifest.h>
#include <ensonify/engine/output/npz.h>
#include <ensonify/engine/output/pings_csv.h>
#include <ensonify/engine/output/png.h>
#include <ensonify/engine/output/recording.h>
#include <ensonify/engine/output/targets_json.h>
#include <ensonify/engine/output/xtf.h>
#include <ensonify/engine/scene/reader.h>
#include <ensonify/refine/atomic_file.h>
#include <ensonify/refine/parallel_for.h>

namespace ensonify::engine {
namespace {

namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;

double seconds_since(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

/// The folder of a run, which takes back what it was given unless the run is kept.
class OutputFolder {
 public:
  explicit OutputFolder(fs::path folder) : folder_(std::move(folder)) {
    made_ = fs::create_directories(folder_);
  }
  ~OutputFolder() {
    if (kept_) return;
    std::error_code ignored;
    for (const auto& [name, record] : records_) fs::remove(folder_ / name, ignored);
    if (made_) fs::remove(folder_, ignored);  // only if nothing else is in it
  }
  OutputFolder(const OutputFolder&) = delete;
  OutputFolder& operator=(const OutputFolder&) = delete;

  void write(const std::string& name, std::span<const std::byte> content) {
    const Clock::time_point start = Clock::now();
    refine::write_file(folder_ / name, content);
    disk_s_ += seconds_since(start);
    records_[name] = {name, content.size(), xxh128(content)};
  }
  void write(const std::string& name, std::string_view text) {
    write(name, std::as_bytes(std::span(text)));
  }
  void keep() { kept_ = true; }
  /// By name, whatever the order of writing.
  std::vector<FileRecord> records() const {
    std::vector<FileRecord> all;
    for (const auto& [name, record] : records_) all.push_back(record);
    return all;
  }
  const fs::path& path() const { return folder_; }
  double disk_s() const { return disk_s_; }

 private:
  fs::path folder_;
  bool made_ = false;
  bool kept_ = false;
  double disk_s_ = 0.0;
  std::map<std::string, FileRecord> records_;
};

/// A scene's run while it goes on: what its threads share.
class Run {
 public:
  Run(const Scene& scene, const fs::path& folder, const RunControl& control)
      : scene_(scene), control_(control), folder_(folder) {}

  RunReport report() {
    Clock::time_point start = Clock::now();
    Simulator simulator(scene_, {.cache = control_.cache,
                                 .threads = control_.threads,
                                 .progress = [&](std::string_view stage) { tell(stage, 0, 1); },
                                 .seafloor = control_.seafloor});
    Flight flight = simulator.flight();
    poses_ = std::move(flight.poses);
    reported_ = reported_poses(scene_.navigation, scene_.seed, poses_);
    report_.prepare_s = seconds_since(start);
    const PreparedSeafloor& prepared = simulator.prepared();
    report_.surface = prepared.surface;
    report_.surface_why = prepared.why;
    report_.cache_file = prepared.cache_file;
    report_.cached = prepared.cached;
    const std::vector<std::string> cache_warnings = prepared.warnings;
    report_.counts["vertices"] = simulator.seafloor().vertices;
    report_.counts["faces"] = simulator.seafloor().faces;
    report_.counts["repairs"] = simulator.seafloor().repairs;
    report_.warnings.assign(simulator.warnings().begin(), simulator.warnings().end());
    report_.warnings.insert(report_.warnings.end(), flight.warnings.begin(), flight.warnings.end());

    start = Clock::now();
    for (const Sonar& sonar : simulator.sonars()) images_.emplace_back(sonar, poses_.size());
    do_pings(simulator);
    report_.pings_s = seconds_since(start);

    start = Clock::now();
    write_files(simulator);
    report_.files_s = seconds_since(start);
    report_.disk_s = folder_.disk_s();
    folder_.keep();
    // Not in the manifest: the files do not depend on the cache.
    report_.warnings.insert(report_.warnings.end(), cache_warnings.begin(), cache_warnings.end());
    for (const FileRecord& file : folder_.records())
      report_.files.push_back(folder_.path() / file.name);
    return std::move(report_);
  }

 private:
  void tell(std::string_view stage, std::size_t done, std::size_t of) {
    if (control_.progress && !control_.progress(stage, done, of))
      throw Stopped("stopped on request; the files of this run were removed");
  }

  void do_pings(Simulator& simulator) {
    const auto block_pings = static_cast<std::size_t>(scene_.run.block_pings);
    const std::size_t blocks = (poses_.size() + block_pings - 1) / block_pings;
    const int threads = refine::thread_count(control_.threads);
    std::vector<std::optional<Simulator>> workers(static_cast<std::size_t>(threads));
    workers.front() = std::move(simulator);
    Simulator& first = *workers.front();

    tell("pings", 0, poses_.size());
    refine::parallel_for(blocks, threads, [&](std::size_t block, int worker) {
      std::optional<Simulator>& mine = workers[static_cast<std::size_t>(worker)];
      if (!mine) mine = first.another();
      const std::size_t begin = block * block_pings;
      const std::size_t end = std::min(begin + block_pings, poses_.size());
      mine->reset();
      for (std::size_t ping = begin; ping < end; ++ping) do_ping(*mine, ping, block);
      finish_block(*mine, end - begin);
    });
    for (const std::optional<Simulator>& worker : workers)
      if (worker) report_.stages += worker->times();
    simulator = std::move(first);
  }

  void do_ping(Simulator& simulator, std::size_t ping, std::size_t block) {
    const Pose& pose = poses_[ping];
    std::span<const EchoLine> lines = simulator.ping(pose, ping);
    const PingRecord record{.pose = pose,
                            .reported = reported_[ping],
                            .altitude_m = simulator.altitude_m(pose.position),
                            .block = static_cast<int>(block)};
    const std::shared_lock rows_differ(images_lock_);
    for (Waterfall& image : images_) {
      const std::size_t sides = sides_of(image.sonar).size();
      image.set_row(ping, lines.first(sides), record);
      for (const EchoLine& line : lines.first(sides)) {
        rays_ += line.rays;
        hits_ += line.hits;
      }
      lines = lines.subspan(sides);
    }
  }

  // The picture grows while the run goes on, from the first block, and takes a twentieth of the time
  // at most.
  void finish_block(const Simulator& simulator, std::size_t pings) {
    const std::unique_lock alone(images_lock_);
    pings_done_ += pings;
    tell("pings", pings_done_, poses_.size());
    if (!control_.growing_picture ||
        seconds_since(picture_written_) < std::max(1.0, 20.0 * picture_s_))
      return;
    const Clock::time_point start = Clock::now();
    for (std::size_t i = 0; i < images_.size(); ++i) write_picture(simulator, i);
    picture_s_ = seconds_since(start);
    picture_written_ = Clock::now();
  }

  void write_picture(const Simulator& simulator, std::size_t sonar) {
    folder_.write(
        images_[sonar].sonar.name + ".png",
        encode_png(render(images_[sonar], scene_.display, simulator.absorption_db_per_m(sonar))));
  }

  void write_files(const Simulator& simulator) {
    const std::string scene_toml = dump_scene(scene_, false);
    const ImageOrigin origin{simulator.seafloor().mesh.world_origin, xxh128(scene_toml)};
    std::uint64_t starved = 0;
    for (std::size_t i = 0; i < images_.size(); ++i) {
      tell("files", i, images_.size());
      const std::string& name = images_[i].sonar.name;
      write_picture(simulator, i);
      if (scene_.output.exr) folder_.write(name + ".exr", encode_exr(images_[i], origin));
      if (scene_.output.npz) folder_.write(name + ".npz", encode_npz(images_[i], origin));
      folder_.write(name + "_pings.csv", pings_csv(images_[i]));
      write_recordings(simulator, i);
      if (!simulator.seafloor().objects.empty())
        folder_.write(name + "_targets.json",
                      targets_json(find_targets(images_[i]), images_[i], simulator.seafloor()));
      for (const PingRecord& ping : images_[i].pings)
        starved += static_cast<std::uint64_t>(ping.starved_port + ping.starved_starboard);
    }
    if (control_.made) control_.made(simulator, images_);
    report_.counts["pings"] = poses_.size();
    report_.counts["rays"] = rays_;
    report_.counts["hits"] = hits_;
    report_.counts["starved_bins"] = starved;
    warn_of_holes();

    Manifest manifest{.scene_toml = scene_toml,
                      .seed = scene_.seed,
                      .surface = report_.surface,
                      .intersector = scene_.run.intersector,
                      .code_path = std::string(simulator.code_path()),
                      .classes = simulator.seafloor().classes,
                      .materials = simulator.seafloor().materials,
                      .counts = report_.counts,
                      .warnings = report_.warnings,
                      .files = folder_.records()};
    folder_.write("manifest.json", manifest_json(manifest));
    tell("files", images_.size(), images_.size());
  }

  void write_recordings(const Simulator& simulator, std::size_t sonar) {
    if (!scene_.output.xtf && !scene_.output.jsf) return;
    const TrackOptions& track = scene_.track;
    const Seafloor& seafloor = simulator.seafloor();
    RecordingFrame frame{.world_origin = seafloor.mesh.world_origin,
                         .utm_zone = seafloor.utm_zone,
                         .start_time = scene_.output.start_time,
                         .sound_speed_mps = simulator.sound_speed_mps(),
                         .absorption_db_per_m = simulator.absorption_db_per_m(sonar)};
    if (track.origin_latitude_rad)
      frame.origin = {*track.origin_latitude_rad, *track.origin_longitude_rad};
    const Recording recording = make_recording(images_[sonar], frame);
    if (scene_.output.xtf) folder_.write(recording.name + ".xtf", encode_xtf(recording));
    if (scene_.output.jsf) folder_.write(recording.name + ".jsf", encode_jsf(recording));
  }

  void warn_of_holes() {
    const auto over_hole =
        std::count_if(images_.front().pings.begin(), images_.front().pings.end(),
                      [](const PingRecord& p) { return std::isnan(p.altitude_m); });
    if (over_hole > 0)
      report_.warnings.push_back(
          fmt::format("{} of {} pings have no bed straight below (a hole in the seafloor); their "
                      "altitude is empty",
                      over_hole, poses_.size()));
  }

  const Scene& scene_;
  const RunControl& control_;
  OutputFolder folder_;
  RunReport report_;
  std::vector<Pose> poses_, reported_;
  std::vector<Waterfall> images_;
  std::shared_mutex images_lock_;  // shared: each thread writes its own rows; alone: all are read
  std::atomic<std::uint64_t> rays_ = 0, hits_ = 0;
  std::size_t pings_done_ = 0;
  Clock::time_point picture_written_{};  // long ago, so that the first block shows
  double picture_s_ = 0.0;
};

}  // namespace

RunReport run(const Scene& scene, const fs::path& folder, const RunControl& control) {
  try {
    return Run(scene, folder, control).report();
  } catch (const refine::DamagedFile& damage) {
    // Found at its first touch, in the middle of the run: what came from it before was sound, but
    // begins anew as well. A file that the scene names is the user's own.
    if (scene.seafloor.kind == SeafloorKind::progressive) throw;
    std::error_code ignored;
    fs::remove(cache_file(scene, control.cache), ignored);
    RunControl anew = control;
    anew.seafloor = nullptr;
    RunReport report = Run(scene, folder, anew).report();
    report.warnings.push_back(fmt::format("{}; it was made anew", damage.what()));
    return report;
  }
}

}  // namespace ensonify::engine
