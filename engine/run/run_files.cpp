#include <ensonify/engine/run/run_files.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <future>
#include <optional>
#include <string_view>
#include <variant>

#include <fmt/format.h>

#include <ensonify/engine/image/fan_picture.h>
#include <ensonify/engine/image/label_names.h>
#include <ensonify/engine/image/picture_columns.h>
#include <ensonify/engine/image/truth_picture.h>
#include <ensonify/engine/output/pings_csv.h>
#include <ensonify/engine/output/png.h>
#include <ensonify/engine/output/recording.h>
#include <ensonify/engine/output/targets_json.h>
#include <ensonify/engine/run/run_state.h>
#include <ensonify/engine/scene/output_formats.h>
#include <ensonify/engine/trace/check/agreement.h>
#include <ensonify/refine/parallel_for.h>

namespace ensonify::engine {
namespace {

/// How many sonars have a lower frequency, or the same frequency and a lower number.
int frequency_rank(std::span<const Sonar> sonars, std::size_t sonar) {
  int rank = 0;
  for (std::size_t other = 0; other < sonars.size(); ++other) {
    const double more_hz = sonars[other].frequency_hz - sonars[sonar].frequency_hz;
    if (more_hz < 0.0 || (more_hz == 0.0 && other < sonar)) ++rank;
  }
  return rank;
}

Recording recording_of(const RunState& run, const Waterfall& image, const Simulator& simulator,
                       std::size_t sonar) {
  const Seafloor& seafloor = simulator.seafloor();
  const RecordingFrame frame{.origin = run.middle,
                             .world_origin = seafloor.mesh.world_origin,
                             .utm_zone = seafloor.utm_zone,
                             .reference = run.plan.reference,
                             .start_time = run.scene.output.start_time,
                             .sound_speed_mps = simulator.sound_speed_mps(),
                             .altitude_m = std::bind_front(&Simulator::altitude_m, &simulator),
                             .frequency_rank = frequency_rank(simulator.sonars(), sonar)};
  return make_recording(image, SimulatorInternals::full_scale_by_beam(simulator, sonar), frame);
}

void count(const ScenePings& pings, PartRecord& record) {
  std::map<std::string, std::uint64_t>& counts = record.counts;
  counts["pings"] = pings.pings.count;
  counts["rays"] = pings.rays;
  counts["hits"] = pings.hits;
  counts["starved_bins"] = 0;
  if (const RefractionCounts& bent = pings.refraction; bent.rays > 0) {
    counts["bent_rays"] = bent.rays;
    counts["bent_rays_by_chords"] = bent.rays - bent.straightened;
    counts["chords"] = bent.chords;
  }
  for (const Waterfall& image : pings.images)
    for (const PingRow& ping : image.pings)
      for (const LineRecord& line : ping.lines)
        counts["starved_bins"] += static_cast<std::uint64_t>(line.starved);
  const Waterfall& first = pings.images.front();
  const std::ptrdiff_t rows_over_hole = std::ranges::count_if(
      first.pings, [](const PingRow& row) { return std::isnan(row.altitude_m); });
  record.pings_over_hole = static_cast<std::uint64_t>(rows_over_hole / first.sonar.beams);
  for (std::size_t i = 0; i < pings.images.size(); ++i)
    record.object_visibility[pings.images[i].sonar.name] = pings.object_visibility[i];
  if (pings.verified_pings == 0) return;
  record.verification["pings"] = pings.verified_pings;
  for_each_count(pings.verified,
                 [&](const char* name, std::uint64_t count) { record.verification[name] = count; });
}

bool has_fans(const Scene& scene, const Sonar& sonar) {
  return scene.output.fans && sonar.steers() && sonar.beams > 1;
}

std::string fan_name(const std::string& name, std::size_t ping) {
  return fmt::format("{}_fan_{:06}.png", name, ping);
}

/// The record of the pings, without files. Renumbers the labels of the images to the names that the
/// scene's output asks for.
PartRecord part_record_of(const RunState& run, ScenePings& pings, const Simulator& simulator) {
  const Seafloor& seafloor = simulator.seafloor();
  const OutputOptions& output = run.scene.output;
  PartRecord record{.pings = pings.pings,
                    .surface = run.report.origin.surface,
                    .code_path = std::string(SimulatorInternals::code_path(simulator)),
                    .names = renumber({seafloor.classes, seafloor.materials},
                                      {output.class_names, output.sediment_names}, pings.images),
                    .seafloor = {{"vertices", seafloor.vertices},
                                 {"faces", seafloor.faces},
                                 {"repairs", seafloor.repairs}},
                    .warnings = run.report.extrapolation.appended_to(run.warnings)};
  count(pings, record);
  return record;
}

}  // namespace

Picture picture_of(const Scene& scene, const Waterfall& image, const Simulator& simulator,
                   std::size_t sonar, const NeighbourRows* neighbours) {
  return render(image, scene.display, simulator.calibration(sonar), scene.output.png_bits,
                neighbours);
}

std::vector<std::string> file_names(const Scene& scene, const std::string& ending,
                                    PingRange pings) {
  const OutputOptions& output = scene.output;
  std::vector<std::string> names;
  for (const Sonar& sonar : scene.sonars) {
    const std::string name = sonar.name + ending;
    for (const char* of_all : {".png", "_pings.csv", "_targets.json"})
      names.push_back(name + of_all);
    if (output.truth) names.push_back(name + "_truth.png");
    if (has_fans(scene, sonar))
      for (std::size_t i = 0; i < pings.count; ++i)
        names.push_back(fan_name(name, pings.first + i));
    for (const OutputFormat& format : output_formats()) {
      if (!(output.*format.wanted)) continue;
      const bool common =
          output.one_recording && std::holds_alternative<EncodeRecording>(format.encode);
      names.push_back(fmt::format("{}.{}", common ? std::string(common_recording) + ending : name,
                                  format.name));
    }
  }
  return names;
}

double most_file_bytes(const Scene& scene, std::span<const Sonar> sonars, std::size_t pings,
                       std::size_t parts) {
  // In bytes:
  constexpr double headers = 16384.0;  // all headers of a sonar's files in a part, and part.json
  constexpr double table_row = 500.0;  // 14 numbers of 20 characters, and short ones
  constexpr double recording_row = 600.0;  // headers of both sides
  const OutputOptions& output = scene.output;
  double layers = 2.0;  // bytes per pixel, of which 2 are for the preview
  BinLayers::for_each([&](std::string_view name, auto layer) {
    if (ImageOrigin{.encoding = output.encoding}.has_layer(name))
      layers += sizeof(typename std::decay_t<decltype(BinLayers{}.*layer)>::value_type);
  });
  const Palette palette = scene.display.palette;
  const double channels = palette == Palette::grey || palette == Palette::paper ? 1.0 : 3.0;
  // Bytes per pixel: once in the part's picture, once in the joined picture.
  double pixel = 2.0 * channels * output.png_bits / 8.0;
  if (output.truth) pixel += 3.0;
  double recordings = 0.0;
  for (const OutputFormat& format : output_formats())
    if (output.*format.wanted)
      (std::holds_alternative<EncodeRecording>(format.encode) ? recordings += 1.0
                                                              : pixel += layers);
  double bytes = 0.0;
  for (const Sonar& sonar : sonars) {
    const double bins = sonar.bins, sides = static_cast<double>(sonar.sectors().size());
    const double row = table_row + sides * bins * pixel +
                       recordings * (recording_row + 2.0 * bins * sizeof(std::uint16_t));
    bytes += static_cast<double>(pings) * sonar.beams * row + static_cast<double>(parts) * headers;
  }
  return bytes;
}

WrittenPings write_files(const RunState& run, ScenePings& pings, const Simulator& simulator,
                         const std::string& ending, int threads, OutputFolder& folder) {
  const Scene& scene = run.scene;
  const Seafloor& seafloor = simulator.seafloor();
  const OutputOptions& output = scene.output;
  WrittenPings written{.record = part_record_of(run, pings, simulator),
                       .pictures = std::vector<Picture>(pings.images.size()),
                       .targets = std::vector<std::vector<TargetRecord>>(pings.images.size())};
  PartRecord& record = written.record;
  const ImageOrigin origin{seafloor.mesh.world_origin, xxh128(run.plan.scene_toml), record.names,
                           output.encoding};

  std::vector<const OutputFormat*> formats;  // of recordings
  for (const OutputFormat& format : output_formats())
    if (output.*format.wanted && std::holds_alternative<EncodeRecording>(format.encode))
      formats.push_back(&format);
  std::vector<std::function<void()>> tasks;
  const auto add_recordings = [&](std::size_t first, std::size_t end, const std::string& name) {
    if (formats.empty()) return;
    tasks.emplace_back([&, first, end, name] {
      std::vector<Recording> sonars;
      for (std::size_t i = first; i < end; ++i) {
        sonars.push_back(recording_of(run, pings.images[i], simulator, i));
        sonars.back().file = name;
      }
      for (const OutputFormat* format : formats)
        folder.write(fmt::format("{}.{}", name, format->name),
                     std::get<EncodeRecording>(format->encode)(sonars));
    });
  };
  if (output.one_recording)
    add_recordings(0, pings.images.size(), std::string(common_recording) + ending);
  for (std::size_t i = 0; i < pings.images.size(); ++i) {
    const Waterfall& image = pings.images[i];
    const Calibration& calibration = simulator.calibration(i);
    const PictureColumns columns =
        picture_columns(simulator.sonars()[i], scene.display, calibration.row_spacing_m);
    const bool picture_is_of_preview =
        output.exr && output.png_bits == 8 && columns == columns_of_bins(image.sonar);
    const NeighbourRows& neighbours = pings.neighbours[i];
    const std::string name = image.sonar.name + ending;
    // The sonar's picture in grey, with one pixel per value of a layer.
    const auto render_preview = [&] {
      Display display = scene.display;
      display.palette = Palette::grey;
      display.slant_range_correction = display.speed_correction = false;
      return render(image, display, calibration, 8, &neighbours);
    };
    const std::shared_future<Picture> preview =
        std::async(std::launch::deferred, render_preview).share();
    for (const OutputFormat& format : output_formats())
      if (const auto* layers = std::get_if<EncodeLayers>(&format.encode);
          layers && output.*format.wanted)
        tasks.emplace_back([&, layers, name, preview, extension = format.name] {
          ImageOrigin own = origin;
          own.preview = [&] { return preview.get(); };
          folder.write(fmt::format("{}.{}", name, extension),
                       [&](const refine::WriteAt& write_at) { (*layers)(image, own, write_at); });
        });
    if (!output.one_recording) add_recordings(i, i + 1, name);
    tasks.emplace_back([&, name, i, preview, picture_is_of_preview] {
      written.pictures[i] = picture_is_of_preview
                                ? painted(preview.get(), scene.display.palette)
                                : picture_of(scene, image, simulator, i, &neighbours);
      folder.write(name + ".png", encode_png(written.pictures[i]));
      if (!has_fans(scene, image.sonar)) return;
      const FanPicture fan(image.sonar);
      for (std::size_t ping = 0; ping < pings.pings.count; ++ping)
        folder.write(fan_name(name, pings.pings.first + ping),
                     encode_png(fan.draw(written.pictures[i], ping)));
    });
    tasks.emplace_back([&, name] { folder.write(name + "_pings.csv", pings_csv(image)); });
    if (!seafloor.objects.empty() || !seafloor.features.empty() || !seafloor.moving.empty())
      tasks.emplace_back([&, name, i, columns, &sights = record.target_sights[image.sonar.name]] {
        std::optional<Waterfall> in_picture;  // the labels in the picture's columns
        if (columns != columns_of_bins(image.sonar)) in_picture = truth_in_columns(columns, image);
        const Waterfall& shown = in_picture ? *in_picture : image;
        written.targets[i] = target_records(shown, seafloor, pings.object_visibility[i]);
        for (const TargetRecord& of_target : written.targets[i]) {
          const Target& target = of_target.target;
          TargetSights& its = sights[target.instance];
          (target.body.area_px > 0 ? its.body : its.shadow) = target.sight;
        }
        folder.write(name + "_targets.json", targets_json(written.targets[i], shown, seafloor));
      });
    if (output.truth)
      tasks.emplace_back([&, name, columns] {
        const TruthPicture truth =
            lay_truth(image, render(image, scene.display, calibration, 8, &neighbours),
                      record.names.classes, record.names.materials, columns);
        folder.write(name + "_truth.png", encode_png(with_legend(truth)));
      });
  }
  refine::parallel_for(tasks.size(), threads, [&](std::size_t task, int) { tasks[task](); });
  return written;
}

}  // namespace ensonify::engine
