#include <ensonify/refine/mesh_reader.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>
#include <utility>

#include <Eigen/Geometry>
#include <fmt/format.h>

#include <ensonify/refine/atomic_file.h>
#include <ensonify/refine/mesh_formats.h>
#include <ensonify/refine/read_file.h>

namespace ensonify::refine {
namespace {

static_assert(std::endian::native == std::endian::little, "bytes are copied as they are");

struct Format {
  std::string_view extension;
  FileMesh (*parse)(std::string_view bytes, std::string_view name);
};
/// In the order of MeshFormat.
constexpr std::array<Format, 4> formats{
    {{".ply", parse_ply}, {".obj", parse_obj}, {".stl", parse_stl}, {".off", parse_off}}};

/// Extensions of formats of meshes and solids that are not read.
constexpr std::array<std::string_view, 24> other_extensions{
    ".dae", ".glb",  ".gltf", ".fbx",  ".3ds",  ".3mf",  ".blend", ".x3d",
    ".wrl", ".vrml", ".usd",  ".usda", ".usdc", ".usdz", ".stp",   ".step",
    ".igs", ".iges", ".dxf",  ".dwg",  ".skp",  ".max",  ".lwo",   ".ctm"};

std::string extension_of(const std::filesystem::path& file) {
  std::string extension = file.extension().string();
  for (char& c : extension)
    if (c >= 'A' && c <= 'Z') c = static_cast<char>(c + 'a' - 'A');
  return extension;
}

/// The middle of the box around the vertices that faces use, in whole metres. The border of
/// rounding is not at one half, so that shifted copies of a scene whose middle is at a half are all
/// rounded to the same side.
Eigen::Vector3d middle(const FileMesh& mesh) {
  Eigen::AlignedBox3d box;
  for (const Face& face : mesh.faces)
    for (const std::uint32_t vertex : face) box.extend(mesh.positions[vertex]);
  return (0.5 * (box.min() + box.max())).array().unaryExpr([](double m) {
    return std::floor(m + 0.501);
  });
}

template <class T>
void append_bytes(std::string& bytes, T value) {
  bytes.append(reinterpret_cast<const char*>(&value), sizeof value);
}

}  // namespace

std::optional<MeshFormat> mesh_format(const std::filesystem::path& file) {
  const auto found = std::ranges::find(formats, extension_of(file), &Format::extension);
  if (found == formats.end()) return std::nullopt;
  return static_cast<MeshFormat>(found - formats.begin());
}

std::string fault_of_other_mesh(const std::filesystem::path& file) {
  const std::string extension = extension_of(file);
  if (std::ranges::find(other_extensions, extension) == other_extensions.end()) return {};
  return fmt::format(
      "is a mesh or a solid in a format that is not read ({}); save it as PLY, OBJ, STL or OFF with "
      "the program that made it, with Blender or with MeshLab",
      extension);
}

TriangleMesh parse_mesh(std::string_view bytes, MeshFormat format, std::string_view name) {
  if (is_utf16(bytes)) fail_at_byte(name, 0, std::string(utf16_fault));
  FileMesh in = formats[static_cast<std::size_t>(format)].parse(bytes, name);
  if (in.positions.size() > std::numeric_limits<std::uint32_t>::max())
    throw MeshError(fmt::format("{}: has {} vertices, more than 32 bits can number; split it", name,
                                in.positions.size()));
  split_concave_polygons(in, name);
  TriangleMesh mesh;
  mesh.world_origin = middle(in);
  mesh.positions.reserve(in.positions.size());
  for (const Eigen::Vector3d& world : in.positions)
    mesh.positions.emplace_back((world - mesh.world_origin).cast<float>());
  mesh.faces = std::move(in.faces);
  return mesh;
}

TriangleMesh read_mesh(const std::filesystem::path& file, const std::function<void()>& stop_check) {
  constexpr std::uintmax_t most = std::numeric_limits<std::uintmax_t>::max();
  const std::optional<MeshFormat> format = mesh_format(file);
  if (const std::string fault = fault_of_other_mesh(file); !fault.empty())
    throw MeshError(file.string() + ": " + fault);
  if (!format)
    throw MeshError(fmt::format("{}: is not named like a mesh; meshes are .ply, .obj, .stl or .off",
                                file.string()));
  return parse_mesh(read_user_file<MeshError>(file, most, stop_check), *format, file.string());
}

void write_ply(const std::filesystem::path& file, const TriangleMesh& mesh) {
  std::string bytes = fmt::format(
      "ply\n"
      "format binary_little_endian 1.0\n"
      "element vertex {}\n"
      "property double x\n"
      "property double y\n"
      "property double z\n"
      "element face {}\n"
      "property list uchar int vertex_indices\n"
      "end_header\n",
      mesh.positions.size(), mesh.faces.size());
  bytes.reserve(bytes.size() + mesh.positions.size() * 3 * sizeof(double) +
                mesh.faces.size() * (1 + 3 * sizeof(std::int32_t)));
  for (const Eigen::Vector3f& position : mesh.positions) {
    const Eigen::Vector3d world = mesh.world_origin + position.cast<double>();
    for (const double value : world) append_bytes(bytes, value);
  }
  for (const Face& face : mesh.faces) {
    append_bytes(bytes, std::uint8_t{3});
    for (const std::uint32_t vertex : face) append_bytes(bytes, static_cast<std::int32_t>(vertex));
  }
  write_file(file, bytes);
}

}  // namespace ensonify::refine
