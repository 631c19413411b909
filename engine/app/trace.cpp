#include <algorithm>
#include <array>
#include <fstream>
#include <memory>

#include <Eigen/Geometry>
#include <fmt/format.h>

#include <ensonify/engine/number_in.h>
#include <ensonify/engine/trace/intersector.h>

#include "app.h"
#include "mesh_file.h"

namespace ensonify::engine::app {
namespace {

constexpr std::array<std::string_view, 8> columns = {"ox", "oy", "oz",    "dx",
                                                     "dy", "dz", "t_min", "t_max"};
constexpr std::size_t required_columns = 6;
constexpr std::size_t longest_line = 4096;

std::string_view trimmed(std::string_view text) {
  constexpr std::string_view space = " \t\r";
  const std::size_t begin = std::min(text.find_first_not_of(space), text.size());
  text.remove_prefix(begin);
  return text.substr(0, text.find_last_not_of(space) + 1);
}

std::vector<std::string_view> split(std::string_view line) {
  std::vector<std::string_view> fields;
  for (std::size_t comma; (comma = line.find(',')) != std::string_view::npos;) {
    fields.push_back(trimmed(line.substr(0, comma)));
    line.remove_prefix(comma + 1);
  }
  fields.push_back(trimmed(line));
  return fields;
}

/// Reads rays from a CSV file, in the file's coordinates.
class RayReader {
 public:
  explicit RayReader(const std::filesystem::path& file)
      : file_(file), stream_(file, std::ios::binary) {
    if (!stream_ || std::filesystem::is_directory(file))
      throw UsageError(fmt::format("{}: cannot be opened for reading", file.string()));
  }

  std::vector<Ray> read() {
    std::string_view header;
    if (!next_line(header))
      throw fault("is empty, expected a header row: ox,oy,oz,dx,dy,dz[,t_min,t_max]");
    read_header(header);
    std::vector<Ray> rays;
    for (std::string_view line; next_line(line);)
      if (!trimmed(line).empty()) rays.push_back(ray(line));
    return rays;
  }

 private:
  UsageError fault(std::string_view what) const {
    return UsageError(fmt::format("{}:{}: {}", file_.string(), std::max(line_number_, 1), what));
  }

  bool next_line(std::string_view& line) {
    if (!stream_.getline(buffer_.data(), static_cast<std::streamsize>(buffer_.size()))) {
      if (stream_.eof() && !stream_.bad()) return false;
      ++line_number_;
      throw fault(stream_.bad() ? "cannot be read" : "the line is longer than 4096 characters");
    }
    ++line_number_;
    line = buffer_.data();
    if (line_number_ == 1 && line.starts_with("\xef\xbb\xbf")) line.remove_prefix(3);
    return true;
  }

  void read_header(std::string_view line) {
    for (const std::string_view name : split(line)) {
      const auto column = std::ranges::find(columns, name);
      if (column == columns.end())
        throw fault(fmt::format("unknown column '{}', expected {}", name.substr(0, 40),
                                fmt::join(columns, ",")));
      const auto number = static_cast<std::size_t>(column - columns.begin());
      if (std::ranges::count(order_, number) > 0)
        throw fault(fmt::format("column '{}' occurs twice", name));
      order_.push_back(number);
    }
    for (std::size_t i = 0; i < required_columns; ++i)
      if (std::ranges::count(order_, i) == 0)
        throw fault(
            fmt::format("no column '{}', expected ox,oy,oz,dx,dy,dz[,t_min,t_max]", columns[i]));
  }

  Ray ray(std::string_view line) const {
    const std::vector<std::string_view> fields = split(line);
    if (fields.size() != order_.size())
      throw fault(fmt::format("{} values, expected {}", fields.size(), order_.size()));
    const Ray defaults;
    std::array<double, columns.size()> value = {0, 0, 0, 0, 0, 0, defaults.t_min, defaults.t_max};
    for (std::size_t i = 0; i < fields.size(); ++i) {
      const std::string_view field = fields[i];
      const std::string_view digits = field.starts_with('+') ? field.substr(1) : field;
      const std::optional number = number_in<double>(digits);
      if (!number)
        throw fault(
            fmt::format("{} is '{}', expected a number", columns[order_[i]], field.substr(0, 40)));
      value[order_[i]] = *number;
    }
    const auto& [ox, oy, oz, dx, dy, dz, t_min, t_max] = value;
    Ray ray{{ox, oy, oz}, {dx, dy, dz}, t_min, t_max};
    try {
      check_ray(ray);
    } catch (const std::invalid_argument& error) {
      throw fault(error.what());
    }
    return ray;
  }

  const std::filesystem::path& file_;
  std::ifstream stream_;
  std::array<char, longest_line + 1> buffer_;
  int line_number_ = 0;
  std::vector<std::size_t> order_;  // the index into `columns` of each field
};

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
  std::vector<Ray> rays = RayReader(ray_file).read();
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
  command
      .add_option("--intersector", arguments->intersector,
                  "One of `ensonify intersectors` that takes single rays: not fan_scan")
      ->capture_default_str()
      ->type_name("NAME");
  command.callback([&action, arguments] {
    action = [arguments] {
      trace(arguments->mesh, arguments->cell_m, arguments->rays, arguments->intersector);
    };
  });
}

}  // namespace ensonify::engine::app
