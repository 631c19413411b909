#include <ensonify/engine/run.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <map>
#include <optional>
#include <span>
#include <string_view>

#include <fmt/format.h>

#include <ensonify/engine/clock.h>
#include <ensonify/engine/image/display.h>
#include <ensonify/engine/image/label_names.h>
#include <ensonify/engine/image/target_record.h>
#include <ensonify/engine/image/truth_picture.h>
#include <ensonify/engine/image/waterfall.h>
#include <ensonify/engine/output/manifest.h>
#include <ensonify/engine/output/pings_csv.h>
#include <ensonify/engine/output/png.h>
#include <ensonify/engine/output/recording.h>
#include <ensonify/engine/output/targets_json.h>
#include <ensonify/engine/ping_all.h>
#include <ensonify/engine/scene/output_formats.h>
#include <ensonify/engine/scene/reader.h>
#include <ensonify/engine/simulator_internals.h>
#include <ensonify/engine/trace/check/agreement.h>
#include <ensonify/refine/atomic_file.h>

namespace ensonify::engine {
namespace {

namespace fs = std::filesystem;

constexpr double nominal_sound_speed_mps = 1500.0;  // for the bins of a digitiser

/// The folder of a run. Removes the files that it wrote, unless the run is kept.
class OutputFolder {
 public:
  explicit OutputFolder(fs::path folder) : folder_(std::move(folder)) {
    made_ = refine::make_folder(folder_);
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

/// How many sonars have a lower frequency, or the same and come before.
int frequency_rank(std::span<const Sonar> sonars, std::size_t sonar) {
  int rank = 0;
  for (std::size_t other = 0; other < sonars.size(); ++other) {
    const double more_hz = sonars[other].frequency_hz - sonars[sonar].frequency_hz;
    if (more_hz < 0.0 || (more_hz == 0.0 && other < sonar)) ++rank;
  }
  return rank;
}

/// A scene's run while it goes on.
class Run {
 public:
  Run(const Scene& scene, const fs::path& folder, const RunControl& control)
      : scene_(scene), control_(control), folder_(folder) {}

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
    report_.counts["vertices"] = simulator.seafloor().vertices;
    report_.counts["faces"] = simulator.seafloor().faces;
    report_.counts["repairs"] = simulator.seafloor().repairs;
    report_.warnings.assign(simulator.warnings().begin(), simulator.warnings().end());
    report_.extrapolation = {simulator.sonars(), simulator.materials(), scene_.materials};

    start = Clock::now();
    pings_ = ping_all(
        scene_, simulator, control_.threads,
        [&](std::span<const Waterfall> images, std::size_t done, std::size_t of) {
          report_stage("pings", done, of);
          if (done > 0) grow_pictures(simulator, images);
        },
        control_.memory, control_.verify_pings);
    if (control_.verify_pings > 0) take_verification();
    report_.warnings.insert(report_.warnings.end(), pings_.warnings.begin(), pings_.warnings.end());
    report_.stages = pings_.stages;
    report_.pings_s = seconds_since(start);

    start = Clock::now();
    with_memory_for("the files", [&] { write_files(simulator); });
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
  void report_stage(std::string_view stage, std::size_t done, std::size_t of) {
    if (control_.progress && !control_.progress(stage, done, of))
      throw Stopped("stopped on request; the files of this run were removed");
  }

  /// Of the pings that are known before there is a seafloor to fly over; none otherwise. Throws
  /// MemoryError for images that do not even fit by themselves.
  double expected_image_bytes() const {
    if (scene_.track.kind != TrackKind::line) return 0.0;
    std::vector<Sonar> sonars = scene_.sonars;
    for (Sonar& sonar : sonars)
      sonar = sonar.sampled(scene_.sea.sound_speed_mps.value_or(nominal_sound_speed_mps));
    const auto pings = static_cast<std::size_t>(scene_.track.pings);
    require_images(control_.memory, sonars, pings);
    return image_bytes(sonars, pings);
  }

  // The picture grows while the run goes on, from the first block, and takes a twentieth of the
  // time at most.
  void grow_pictures(const Simulator& simulator, std::span<const Waterfall> images) {
    if (!control_.growing_picture ||
        seconds_since(picture_written_) < std::max(1.0, 20.0 * picture_s_))
      return;
    const Clock::time_point start = Clock::now();
    for (std::size_t i = 0; i < images.size(); ++i) write_picture(simulator, images[i], i);
    picture_s_ = seconds_since(start);
    picture_written_ = Clock::now();
  }

  void write_picture(const Simulator& simulator, const Waterfall& image, std::size_t sonar) {
    folder_.write(image.sonar.name + ".png",
                  encode_png(render(image, scene_.display, simulator.calibration(sonar),
                                    scene_.output.png_bits)));
  }

  void write_files(const Simulator& simulator) {
    const std::string scene_toml = dump_scene(scene_, false);
    const Seafloor& seafloor = simulator.seafloor();
    std::vector<Waterfall>& images = pings_.images;
    const OutputOptions& output = scene_.output;
    const LabelNames names = renumber({seafloor.classes, seafloor.materials},
                                      {output.class_names, output.sediment_names}, images);
    const ImageOrigin origin{seafloor.mesh.world_origin, xxh128(scene_toml), names};
    std::uint64_t starved = 0;
    for (std::size_t i = 0; i < images.size(); ++i) {
      report_stage("files", i, images.size());
      const std::string& name = images[i].sonar.name;
      write_picture(simulator, images[i], i);
      write_formats(simulator, i, origin);
      folder_.write(name + "_pings.csv", pings_csv(images[i]));
      if (!seafloor.objects.empty() || !seafloor.features.empty())
        folder_.write(name + "_targets.json",
                      targets_json(target_records(images[i], seafloor, pings_.object_visibility[i]),
                                   images[i], seafloor));
      Display over_layers = scene_.display;
      over_layers.slant_range_correction = false;
      if (scene_.output.truth)
        folder_.write(name + "_truth.png",
                      encode_png(with_legend(lay_truth(
                          images[i], render(images[i], over_layers, simulator.calibration(i)),
                          names.classes, names.materials))));
      for (const PingRow& ping : images[i].pings)
        starved += static_cast<std::uint64_t>(ping.starved_port + ping.starved_starboard);
    }
    if (control_.on_outputs) control_.on_outputs({simulator, images, pings_.object_visibility});
    report_.counts["pings"] = images.front().rows();
    report_.counts["rays"] = pings_.rays;
    if (const RefractionCounts& bent = pings_.refraction; bent.rays > 0) {
      report_.counts["bent_rays"] = bent.rays;
      report_.counts["bent_rays_by_chords"] = bent.rays - bent.straightened;
      report_.counts["chords"] = bent.chords;
    }
    report_.counts["hits"] = pings_.hits;
    report_.counts["starved_bins"] = starved;
    warn_of_holes();

    Manifest manifest{.scene_toml = scene_toml,
                      .seed = scene_.seed,
                      .surface = report_.surface,
                      .intersector = scene_.run.intersector,
                      .code_path = std::string(SimulatorInternals::code_path(simulator)),
                      .classes = names.classes,
                      .materials = names.materials,
                      .counts = report_.counts,
                      .verification = report_.verification,
                      .warnings = report_.extrapolation.behind(report_.warnings),
                      .files = folder_.records()};
    folder_.write("manifest.json", manifest_json(manifest));
    report_stage("files", images.size(), images.size());
  }

  void take_verification() {
    const AgreementCounts& found = pings_.verified;
    std::map<std::string, std::uint64_t>& counts = report_.verification;
    counts = {{"pings", pings_.verified_pings},
              {"rays", found.rays},
              {"coarse", found.coarse},
              {"wrong_index", found.wrong_index},
              {"wrong_run", found.wrong_run}};
    for (std::size_t i = 0; i < verdict_names.size(); ++i)
      counts[verdict_names[i]] = found.verdicts[i];
    const Precision precision = intersector_kind(scene_.run.intersector).precision;
    for (const Limit& limit : limits(RaySource::scene, precision))
      if (exceeds(limit, found))
        report_.warnings.push_back(fmt::format(
            "of {} rays that were verified {} are of the class '{}', more than sound arithmetic "
            "makes (a share of {:g})",
            found.rays, limit.of(found), limit.name, limit.share));
  }

  void write_formats(const Simulator& simulator, std::size_t sonar, const ImageOrigin& origin) {
    const Waterfall& image = pings_.images[sonar];
    std::optional<Recording> recording;  // made once, for all formats
    for (const OutputFormat& format : output_formats()) {
      if (!(scene_.output.*format.wanted)) continue;
      const std::string file = fmt::format("{}.{}", image.sonar.name, format.name);
      if (const auto* layers = std::get_if<EncodeLayers>(&format.encode)) {
        folder_.write(file, (*layers)(image, origin));
      } else {
        if (!recording) recording = recording_of(simulator, sonar);
        folder_.write(file, std::get<EncodeRecording>(format.encode)(*recording));
      }
    }
  }

  Recording recording_of(const Simulator& simulator, std::size_t sonar) const {
    const TrackOptions& track = scene_.track;
    const Seafloor& seafloor = simulator.seafloor();
    RecordingFrame frame{.world_origin = seafloor.mesh.world_origin,
                         .utm_zone = seafloor.utm_zone,
                         .start_time = scene_.output.start_time,
                         .sound_speed_mps = simulator.sound_speed_mps(),
                         .altitude_m = std::bind_front(&Simulator::altitude_m, &simulator),
                         .frequency_rank = frequency_rank(simulator.sonars(), sonar)};
    if (track.origin_latitude_rad)
      frame.origin = {*track.origin_latitude_rad, *track.origin_longitude_rad};
    return make_recording(pings_.images[sonar], SimulatorInternals::recorder(simulator, sonar),
                          frame);
  }

  void warn_of_holes() {
    const auto over_hole =
        std::count_if(pings_.images.front().pings.begin(), pings_.images.front().pings.end(),
                      [](const PingRow& p) { return std::isnan(p.altitude_m); });
    if (over_hole > 0)
      report_.warnings.push_back(
          fmt::format("{} of {} pings have no bed straight below (a hole in the seafloor); their "
                      "altitude is empty",
                      over_hole, pings_.images.front().rows()));
  }

  const Scene& scene_;
  const RunControl& control_;
  OutputFolder folder_;
  RunReport report_;
  ScenePings pings_;
  Clock::time_point picture_written_{};  // long ago, so that the first block shows
  double picture_s_ = 0.0;
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
