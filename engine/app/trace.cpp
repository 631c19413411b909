#include <array>
#include <cstdint>
#include <limits>
#include <memory>

#include <Eigen/Geometry>
#include <fmt/format.h>

#include <ensonify/engine/base/csv_table.h>
#include <ensonify/engine/trace/intersector.h>

#include "app.h"
#include "mesh_file.h"

namespace ensonify::engine::app {
namespace {

constexpr std::array<CsvColumn, 8> ray_columns{
    {{"ox"},
     {"oy"},
     {"oz"},
     {"dx"},
     {"dy"},
     {"dz"},
     {"t_min", false},
     {.name = "t_max", .required = false, .may_be_infinite = true}}};
constexpr CsvFormat ray_format{.row = "ray",
                               .columns = ray_columns,
                               .may_have_no_rows = true,
                               .max_bytes = std::numeric_limits<std::uintmax_t>::max()};

/// The rays of a file, in the file's coordinates.
std::vector<Ray> read_rays(const std::filesystem::path& file) {
  const CsvTable table = CsvTable::read(file, ray_format);
  if (!table.unknown().empty())
    throw UsageError(
        fmt::format("{}: unknown column {}, expected a header row with ox,oy,oz,dx,dy,dz and t_min "
                    "or t_max, or both",
                    file.string(), table.unknown().front()));
  std::vector<Ray> rays;
  for (std::size_t row = 0; row < table.rows(); ++row) {
    const auto at = [&](std::size_t column) { return table.at(row, column); };
    Ray ray{.origin = {at(0), at(1), at(2)}, .direction = {at(3), at(4), at(5)}};
    if (table.has(6)) ray.t_min = at(6);
    if (table.has(7)) ray.t_max = at(7);
    try {
      check_ray(ray);
    } catch (const std::invalid_argument& error) {
      throw table.fault(row, error.what());
    }
    rays.push_back(ray);
  }
  return rays;
}

void print_hits(const refine::Triangles& mesh, const std::vector<Hit>& hits, std::string& out) {
  for (std::size_t i = 0; i < hits.size(); ++i) {
    const Hit& hit = hits[i];
    if (hit) {
      const Eigen::Vector3d a = mesh.corner(hit.face, 0);
      const Eigen::Vector3d normal =
          (mesh.corner(hit.face, 1) - a).cross(mesh.corner(hit.face, 2) - a).stableNormalized();
      out += fmt::format("{},1,{},{:.17g},{:.17g},{:.17g},{:.17g},{:.17g},{:.17g}\n", i, hit.face,
                         hit.t, hit.u, hit.v, normal.x(), normal.y(), normal.z());
    } else {
      out += fmt::format("{},0,,,,,,,\n", i);
    }
  }
}

void trace(const std::filesystem::path& mesh_file, double cell_m,
           const std::filesystem::path& ray_file, const std::string& name) {
  std::vector<Ray> rays = read_rays(ray_file);
  const MeshFile input(mesh_file, cell_m);
  for (Ray& ray : rays) ray.origin -= input.mesh.world_origin;
  const std::unique_ptr<Intersector> intersector = make_intersector(name, input.mesh);
  std::vector<Hit> hits(rays.size());
  intersector->intersect(rays, hits);
  std::string out = "ray,hit,face,t,u,v,nx,ny,nz\n";
  print_hits(input.mesh, hits, out);
  print(out);
}

}  // namespace

void add_trace(CLI::App& app, Action& action) {
  struct Arguments {
    std::filesystem::path mesh, rays;
    double cell_m = 0.0;
    std::string intersector = "embree";
  };
  const auto arguments = std::make_shared<Arguments>();
  CLI::App& command = *app.add_subcommand(
      "trace",
      "Trace rays to a mesh. Input: CSV with the header row ox,oy,oz,dx,dy,dz[,t_min,t_max], "
      "columns in any order, world metres; t is in units of the direction's length. Output: "
      "ray,hit,face,t,u,v,nx,ny,nz; rays are numbered from 0; hit is 0 or 1, and without a hit the "
      "other columns are empty; u and v are the weights of the face's second and third corner; the "
      "unit normal follows from the order of the face's corners");
  command.add_option("MESH", arguments->mesh, "A mesh (PLY, OBJ, STL, OFF) or a survey grid")
      ->required();
  add_cell(command, arguments->cell_m);
  command.add_option("RAYS", arguments->rays, "The rays, CSV")->required();
  add_value(command, "--intersector", arguments->intersector, "NAME",
            "One of `ensonify intersectors` that takes single rays: not fan_scan")
      ->capture_default_str();
  command.callback([&action, arguments] {
    action = [arguments] {
      trace(arguments->mesh, arguments->cell_m, arguments->rays, arguments->intersector);
    };
  });
}

}  // namespace ensonify::engine::app
