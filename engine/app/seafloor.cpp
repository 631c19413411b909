#include <ensonify/engine/prepare.h>

#include <memory>

#include <fmt/format.h>

#include <ensonify/engine/output/geotiff.h>
#include <ensonify/engine/output/npz.h>
#include <ensonify/engine/run.h>
#include <ensonify/refine/atomic_file.h>
#include <ensonify/refine/mesh_reader.h>

#include "app.h"

namespace ensonify::engine::app {
namespace {

struct Arguments {
  SceneArguments scene;
  std::filesystem::path file;
};

void stop_if_asked() {
  if (SignalWatch::caught() != 0) throw Stopped("stopped on request; nothing was written");
}

void write_seafloor(const Arguments& arguments) {
  const std::string kind = arguments.file.extension().string();
  if (kind != ".ply" && kind != ".npy" && kind != ".tif")
    throw UsageError(fmt::format("{}: a seafloor is written as .ply, .npy or .tif, not as '{}'",
                                 arguments.file.string(), kind));
  const Scene scene = arguments.scene.read();
  const SignalWatch signals;  // so that no temporary file is left
  if (kind == ".ply") {
    const refine::TriangleMesh mesh = seafloor_of(scene).mesh;
    stop_if_asked();
    refine::write_ply(arguments.file, mesh);
  } else {
    const Heightfield field = make_heightfield(scene.seafloor, scene.bed_seed());
    stop_if_asked();
    refine::write_file(arguments.file,
                       kind == ".tif" ? encode_geotiff(field)
                                      : encode_npy(field.z_m, static_cast<std::size_t>(field.rows),
                                                   static_cast<std::size_t>(field.columns)));
  }
}

}  // namespace

void add_seafloor(CLI::App& app, Action& action) {
  const auto arguments = std::make_shared<Arguments>();
  CLI::App& command = *app.add_subcommand("seafloor",
                                          "Write a scene's seafloor: a mesh in world metres "
                                          "(.ply), its heights over the sea surface, float64, "
                                          "the southern row first, NaN for holes (.npy), or a "
                                          "GeoTIFF of world heights (.tif)");
  arguments->scene.add_to(command);
  command.add_option("-o,--output", arguments->file, "The file: .ply, .npy or .tif")
      ->type_name("FILE")
      ->required();
  command.callback([&action, arguments] { action = [arguments] { write_seafloor(*arguments); }; });
}

}  // namespace ensonify::engine::app
