// Writes the first inputs of the fuzz targets: `seeds FOLDER` makes FOLDER/TARGET/NUMBER.

#include <filesystem>
#include <map>
#include <string>

#include <ensonify/engine/output/jsf.h>
#include <ensonify/engine/output/png.h>
#include <ensonify/engine/output/tar.h>
#include <ensonify/engine/output/xtf.h>
#include <ensonify/engine/scene/dump.h>
#include <ensonify/refine/read_file.h>

#include "support/damaged_meshes.h"
#include "support/files.h"
#include "support/grids.h"
#include "support/small_dataset.h"
#include "support/small_recording.h"
#include "support/small_run.h"
#include "support/temporary_folder.h"
#include "support/tiny_recipe.h"
#include "support/tricky_meshes.h"

using namespace ensonify;

namespace {

constexpr std::size_t largest_seed_bytes = 4096;

class Seeds {
 public:
  explicit Seeds(std::filesystem::path folder) : folder_(std::move(folder)) {}
  void add(const std::string& target, const std::string& bytes) {
    if (bytes.size() > largest_seed_bytes) return;
    std::filesystem::create_directories(folder_ / target);
    tests::write_text(folder_ / target / std::to_string(++count_[target]), bytes);
  }

 private:
  std::filesystem::path folder_;
  std::map<std::string, int> count_;
};

std::string target(refine::MeshFormat format) {
  switch (format) {
    case refine::MeshFormat::ply: return "mesh_ply";
    case refine::MeshFormat::obj: return "mesh_obj";
    case refine::MeshFormat::stl: return "mesh_stl";
    default: return "mesh_off";
  }
}

/// A tar with one file.
std::string tar_of(const std::string& name, const std::string& content) {
  const tests::TemporaryFolder folder;
  engine::TarFile tar(folder / "a.tar");
  tar.add(name, std::as_bytes(std::span(content)));
  tar.finish();
  // Without most of the zeros at its end.
  return refine::read_file(folder / "a.tar").substr(0, 2048);
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 2) return 2;
  Seeds seeds(argv[1]);

  for (const tests::TrickyMesh& mesh : tests::tricky_meshes())
    seeds.add(target(mesh.format), mesh.bytes);
  for (const tests::DamagedMesh& mesh : tests::damaged_meshes())
    seeds.add(target(mesh.format), mesh.bytes);

  for (const char file : {'\0', '\1', '\2'})
    for (const char section :
         {'\1', '\3', '\4', '\5', '\7', '\xc0'})  // one change each, without effect
      seeds.add("progressive_mesh",
                std::string{file, section, '\2', '\0', '\0', '\x80', '\0', '\0', '\0'});

  const std::string heights = "-10 -10.5 -11\n-9 -9999 -12\n-10 -11 -1e1\n-8 -9 -10\n";
  seeds.add("grid", "ncols 3\nnrows 4\nxllcorner 0\nyllcorner 0\ncellsize 1\nNODATA_value -9999\n" +
                        heights);
  seeds.add("grid",
            "ncols 3\r\nnrows 4\r\nxllcenter 500000.5\r\nyllcenter 6.2e6\r\ndx 0.5\r\ndy 2\r\n" +
                heights);
  tests::Tiff tiff{.columns = 2, .rows = 3, .heights = {-1, -2, -3, -4, -5, -6}};
  seeds.add("grid", tiff.bytes());
  tiff.nodata = "-4";
  tiff.geographic = true;
  seeds.add("grid", tiff.bytes());

  std::string scene = engine::dump_scene(engine::Scene{}, false);
  seeds.add("scene", scene);
  scene += "[[objects]]\nmesh = 'file'\n[[objects]]\nmesh = 'file'\nscale = 2\n";
  const std::string zero(1, '\0');
  seeds.add("scene", scene + zero + "track.pings=3" + zero + "display.palette=copper");
  seeds.add("scene",
            "version = 1\nseed = 0x7f\nsea = {salinity_psu = 35.0}\n[seafloor]\nkind = 'survey'\n"
            "survey = \"f\\u0069le\" # there\n[sonar]\na-1.range_m = 1_0.0e1\nb = {bins = 2}\n");

  seeds.add("track",
            "t_s,x_m,y_m,z_m,roll_deg,pitch_deg,heading_deg\n0,0,0,-5,1,2,3\n1,2,0,-5,1,2,3\n");
  seeds.add("track",
            "# a recording\nping,utc_s,lat_deg,lon_deg,depth_m,altitude_m\n1,7.5,48.4,-68.8,14,11\n"
            "2,7.6,48.4,-68.8,14,11\n");
  std::vector<engine::Recording> sonars{tests::small_recording(), tests::small_recording(8)};
  sonars.back().frequency_rank = 1;
  for (const std::size_t count : {1u, 2u}) {
    seeds.add("recording", tests::as_text(engine::encode_xtf({sonars.data(), count})));
    seeds.add("recording", tests::as_text(engine::encode_jsf({sonars.data(), count})));
  }
  seeds.add("profile", "depth_m,soundspeed_mps\n0,1500.5\n10,1490\n");
  seeds.add(
      "strength_table",
      "grazing_deg,strength_db,frequency_hz\n10,-30,1e5\n80,-20,1e5\n5,-33,4e5\n90,-10,4e5\n");
  seeds.add("vertical_pattern", "depression_deg,level_db\n-90,-20\n30,0\n40,-3\n");
  seeds.add("vertical_pattern", "depression_deg,port_db,starboard_db\n0,-1,-2\n10,-3,-4\n");
  seeds.add("recipe", tests::tiny_recipe);
  seeds.add("profile",
            tests::byte_order_mark +
                "# a cast\r\ntime,\"soundspeed_mps\",depth_m\r\n\r\n3,1500,2e1\r\n,1.49e3,0\r\n");
  seeds.add("profile",
            "% Device,11E101663\n% \nPressure (Decibar),Depth (Meter),Sound velocity (Meters per "
            "Second)\n0.15,0.1496,1512.63\n0.45,0.4490,1512.65\n");

  seeds.add("path", "# a cable\neast_m,north_m\n0,0\n12.5,-3\n1e2,4\n");
  seeds.add("outlines",
            R"({"type": "FeatureCollection", "features": [{"type": "Feature", "properties": {},)"
            R"( "geometry": {"type": "Polygon", "coordinates":)"
            R"( [[[0, 0], [9, 0], [9, 9], [0, 0]], [[1, 1], [2, 1], [2, 2], [1, 1]]]}}]})");
  seeds.add("outlines", R"({"type": "MultiPolygon", "coordinates": [[[[0, 0], [9, 0], [9, 9]]]]})");
  const std::string grey = tests::as_text(
      engine::encode_png({.width = 3, .height = 2, .channels = 1, .pixels = {0, 1, 1, 0, 1, 2}}));
  const std::string colour = tests::as_text(
      engine::encode_png({.width = 2, .height = 1, .channels = 3, .pixels = {0, 1, 1, 0, 1, 2}}));
  for (const std::string& picture : {grey, colour})
    for (const char* reader : {"area_image", "picture", "png"}) seeds.add(reader, picture);
  seeds.add(
      "area_image",
      tests::Tiff{.columns = 2, .rows = 1, .heights = {1, 2}, .transform = {-9, 9, 0, 9, 0, -18}}
          .bytes());

  const tests::SmallRun run;
  seeds.add("run_image", run.image);
  seeds.add("recorded_run", run.manifest + zero + run.table);
  const std::string target =
      R"("instance": 1, "range_m": 5.5, "side": "port", "ping": 1, "contrast_db": 3, "shadow": null,)"
      R"( "body": {"box": [1, 1, 2, 1], "area_px": 2, "polygons": [[1, 1, 3, 1, 3, 2, 1, 2]]})";
  seeds.add(
      "run_parts",
      R"({"version": "1", "libraries": {"a": "1"}, "scene": "version = 1\n[a]\nb = 1\n",)"
      R"( "seed": 1, "intersector": "embree", "reference": "", "verify_pings": 0,)"
      R"( "input_files": {}, "pings": 2, "first_pings": [0]})" +
          zero +
          R"({"run_xxh128": "0", "first_ping": 0, "pings": 2, "surface": "static", "instruction_set": "AVX2",)"
          R"( "classes": ["none"], "materials": ["none"], "seafloor": {"faces": 1},)"
          R"( "counts": {"pings": 2}, "verification": {}, "pings_over_hole": 0,)"
          R"( "object_visibility": {"left-right": {"objects": 1, "views": [0, 2, 1]}},)"
          R"( "target_sights": {"left-right": [[1, true, 2, 0, -2.5, 1]]},)"
          R"( "warnings": [], "files": [{"name": "a", "size_bytes": 1, "xxh128": "0"}]})" +
          zero + R"({"picture": {"columns": 9, "rows": 2}, "targets": [{)" + target + "}]}");
  const tests::SmallDataset dataset;
  seeds.add("dataset", dataset.dataset + zero + dataset.sample + zero + dataset.labels);
  seeds.add("tar", tar_of("000000.a.json", "{}\n"));
  seeds.add("analysed",
            R"({"vertices": 12, "faces": 12, "bed_faces": 12, "mean_bed_m": -5, "utm_zone": 19,)"
            R"( "labels": [[0, 0, 0, false, false], [1, 1, 1, true, false]],)"
            R"( "classes": ["none", "crate"], "materials": ["none", "sand"], "repairs": 0,)"
            R"( "warnings": [], "objects": [{"table": 0, "middle_m": [0, 0, 0], "size_m":)"
            R"( [1, 1, 1], "heading_rad": 0, "scale": 1, "buried": 0, "label":)"
            R"( [1, 1, 1, true, false]}], "features": []})");

  for (const char* request :
       {R"({"t_s": 0.5, "x_m": 0, "y_m": 1, "z_m": -12, "roll_deg": 2, "vx_mps": 1})",
        R"({"set": {"sonar.left-right.range_m": 12.5}})",
        R"({"add": {"shape": "cylinder", "material": "plain"}, "x_m": 1, "y_m": 0, "z_m": -18})",
        R"({"move": 1, "x_m": 1, "y_m": 0, "z_m": -18})", R"({"remove": 1})"})
    seeds.add("stream_request", request);
  for (const char* request :
       {R"({"hold": true, "again": false, "clear": true, "pings_per_s": null})",
        R"({"set": {"sonar.left-right.range_m": 12.5, "track.altitude_m": 6}})",
        R"({"set": {"display.palette": "copper"}})", R"({"set": {"seafloor.material": "mud"}})",
        R"({"add": {"shape": "barrel", "material": "plain", "ahead_m": 10, "starboard_m": -2}})"})
    seeds.add("live_change", request);
  return 0;
}
