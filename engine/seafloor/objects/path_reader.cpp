#include <ensonify/engine/seafloor/objects/path_reader.h>

#include <charconv>
#include <cmath>
#include <fstream>
#include <string>
#include <string_view>

#include <fmt/format.h>

#include <ensonify/refine/triangle_mesh.h>

namespace ensonify::engine {
namespace {

constexpr std::uintmax_t largest_file_bytes = 4 << 20;
constexpr double farthest_m = 1e6;
constexpr std::string_view byte_order_mark = "\xef\xbb\xbf";  // of UTF-8

}  // namespace

std::vector<Eigen::Vector2d> read_path(const std::filesystem::path& file) {
  std::size_t line_number = 0;
  const auto error_here = [&](std::string_view what) {
    return refine::MeshError(fmt::format("{}:{}: {}", file.string(), line_number, what));
  };
  std::error_code error;
  const std::uintmax_t size = std::filesystem::file_size(file, error);
  std::ifstream stream(file, std::ios::binary);
  if (error || !stream)
    throw refine::MeshError(fmt::format("{}: cannot be opened for reading", file.string()));
  if (size > largest_file_bytes)
    throw refine::MeshError(
        fmt::format("{}: is larger than 4 MiB, expected the points of a path", file.string()));
  std::vector<Eigen::Vector2d> path;
  bool header = false;
  for (std::string line; std::getline(stream, line);) {
    ++line_number;
    if (line_number == 1 && line.starts_with(byte_order_mark))
      line.erase(0, byte_order_mark.size());
    std::erase_if(line, [](char c) { return c == ' ' || c == '\t' || c == '\r'; });
    if (line.empty() || line.starts_with('#')) continue;
    if (!header) {
      if (line != "east_m,north_m") throw error_here("expected the header row east_m,north_m");
      header = true;
      continue;
    }
    Eigen::Vector2d point;
    const char* at = line.data();
    const char* const end = at + line.size();
    for (int axis = 0; axis < 2; ++axis) {
      if (axis > 0) at += at != end && *at == ',';
      const auto [next, wrong] = std::from_chars(at, end, point[axis]);
      if (wrong != std::errc() || !(std::abs(point[axis]) <= farthest_m) ||
          (axis > 0 ? next != end : next == end || *next != ','))
        throw error_here("expected two numbers, metres east and north, as in 12.5,-3");
      at = next;
    }
    path.push_back(point);
  }
  if (path.size() < 2) throw error_here("the file ends, expected a path of two points or more");
  return path;
}

}  // namespace ensonify::engine
