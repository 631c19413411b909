#include <ensonify/engine/simulator/prepare.h>

#include <memory>
#include <mutex>
#include <string_view>

#include <fmt/format.h>

#include <ensonify/engine/base/lower_case.h>
#include <ensonify/engine/output/geotiff.h>
#include <ensonify/engine/output/npz.h>
#include <ensonify/engine/run/files_read.h>
#include <ensonify/engine/scene/world_reference.h>
#include <ensonify/engine/seafloor/analysis.h>
#include <ensonify/refine/atomic_file.h>
#include <ensonify/refine/mesh_reader.h>
#include <ensonify/refine/parallel_for.h>

#include "app.h"
#include "progress.h"

namespace ensonify::engine::app {
namespace {

struct SeafloorArguments {
  SceneArguments scene;
  std::filesystem::path file;
  MemoryLimit memory;
  bool quiet = false;
};

void write_seafloor(const SeafloorArguments& arguments) {
  const std::string kind = lower_case(arguments.file.extension().string());
  if (kind != ".ply" && kind != ".npy" && kind != ".tif")
    throw UsageError(fmt::format("{}: a seafloor is written as .ply, .npy or .tif, not as '{}'",
                                 arguments.file.string(), kind));
  const Scene scene = arguments.scene.read();
  require_not_read(arguments.file, arguments.scene.files_read(scene));
  const SignalWatch signals;  // then a signal leaves no temporary file
  Progress progress(arguments.quiet);
  std::mutex reporting;
  const auto report = [&](std::string_view stage) {
    stop_on_signal("stopped on request; nothing was written");
    const std::lock_guard lock(reporting);
    progress.report(stage, 0, 1);
  };
  const WorkControl control{refine::thread_count(0), [&] { report("seafloor"); }};
  if (kind == ".ply") {
    Seafloor seafloor = seafloor_of(scene, {arguments.memory}, BedForm::mesh, control);
    if (seafloor.progressive) {
      const auto faces = static_cast<double>(seafloor.faces);
      arguments.memory.require(
          faces * refine::mesh_bytes_per_face,
          fmt::format("the {:.0f} faces of {}", faces, scene.seafloor.progressive.path.string()),
          "analyse a coarser bed, or a part of it");
      with_memory_for("the seafloor", [&] { restore_mesh(seafloor); });
    }
    report("file");
    refine::write_ply(arguments.file, seafloor.mesh);
  } else {
    const Heightfield field = heights_of(scene, {arguments.memory}, control);
    report("file");
    refine::write_file(
        arguments.file,
        kind == ".tif" ? encode_geotiff(field, world_reference(field.reference, field.world_origin,
                                                               given_origin(scene.track)))
                       : encode_npy(field.z_m, static_cast<std::size_t>(field.rows),
                                    static_cast<std::size_t>(field.columns)));
  }
}

}  // namespace

void add_seafloor(CLI::App& app, Action& action) {
  const auto arguments = std::make_shared<SeafloorArguments>();
  CLI::App& command = *app.add_subcommand(
      "seafloor",
      "Write a scene's seafloor as a mesh or as heights. .ply: a mesh in world metres, with the "
      "objects. .npy: heights relative to the sea surface without the objects, float64, southern "
      "row first, NaN for holes. .tif: a GeoTIFF of world heights without the objects, in the "
      "survey's coordinate reference system, or in one centred at track.origin_lat_deg and "
      "origin_lon_deg, if the scene has either");
  arguments->scene.add_to(command);
  add_output(command, arguments->file, "FILE", "The file to write: .ply, .npy or .tif")->required();
  add_memory(command, arguments->memory);
  add_quiet(command, arguments->quiet, "No progress");
  command.callback([&action, arguments] { action = [arguments] { write_seafloor(*arguments); }; });
}

}  // namespace ensonify::engine::app
