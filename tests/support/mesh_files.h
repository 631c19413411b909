#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstring>
#include <stdexcept>
#include <string>

#include <Eigen/Core>

#include <ensonify/refine/mesh_reader.h>

// Small mesh files, written without the code under test. They all contain the same tetrahedron.
namespace ensonify::tests {

using Mesh = refine::MeshFormat;

constexpr std::array<std::array<float, 3>, 4> tetrahedron_corners{
    {{0, 0, 0}, {2, 0, 0}, {0, 3, 0}, {0, 0, 5}}};
constexpr std::array<std::array<int, 3>, 4> tetrahedron_faces{
    {{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {2, 0, 3}}};

/// A value's bytes, in big-endian order if `big`.
template <class T>
std::string raw(T value, bool big = false) {
  std::string bytes(sizeof value, '\0');
  std::memcpy(bytes.data(), &value, sizeof value);
  if (big) std::reverse(bytes.begin(), bytes.end());
  return bytes;
}

/// A text with the first or each occurrence of a part replaced; the part must occur.
inline std::string replaced(std::string text, const std::string& from, const std::string& to) {
  const std::size_t place = text.find(from);
  if (place == std::string::npos) throw std::logic_error("test: no \"" + from + "\" to replace");
  return text.replace(place, from.size(), to);
}
inline std::string replaced_each(std::string text, const std::string& from, const std::string& to) {
  for (std::size_t at = 0; (at = text.find(from, at)) != std::string::npos; at += to.size())
    text.replace(at, from.size(), to);
  return text;
}

inline const std::string ply_header =
    "ply\n"
    "format ascii 1.0\n"
    "element vertex 4\n"
    "property float x\n"
    "property float y\n"
    "property float z\n"
    "element face 4\n"
    "property list uchar int vertex_indices\n"
    "end_header\n";
inline const std::string vertex_lines = "0 0 0\n2 0 0\n0 3 0\n0 0 5\n";
inline const std::string face_lines = "3 0 2 1\n3 0 1 3\n3 1 2 3\n3 2 0 3\n";

inline const std::string text_ply = ply_header + vertex_lines + face_lines;
inline const std::string text_off = "OFF\n4 4 6\n" + vertex_lines + face_lines;
inline const std::string text_obj =
    "v 0 0 0\nv 2 0 0\nv 0 3 0\nv 0 0 5\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n";

inline std::string binary_ply_header(bool big = false) {
  return replaced(ply_header, "ascii", big ? "binary_big_endian" : "binary_little_endian");
}

/// The values after a PLY's header, with coordinates, counts and indices of any type.
template <class Coordinate = float, class Count = std::uint8_t, class Index = std::int32_t>
std::string ply_body(bool big = false) {
  std::string bytes;
  for (const auto& corner : tetrahedron_corners)
    for (const float value : corner) bytes += raw(static_cast<Coordinate>(value), big);
  for (const auto& face : tetrahedron_faces) {
    bytes += raw(Count{3}, big);
    for (const int vertex : face) bytes += raw(static_cast<Index>(vertex), big);
  }
  return bytes;
}

inline std::string binary_ply(bool big = false) { return binary_ply_header(big) + ply_body(big); }

inline std::string facet(const std::array<int, 3>& face) {
  std::string text = " facet normal 0 0 1\n  outer loop\n";
  for (const int vertex : face) {
    text += "   vertex";
    for (const float value : tetrahedron_corners[static_cast<std::size_t>(vertex)])
      text += ' ' + std::to_string(static_cast<int>(value));
    text += '\n';
  }
  return text + "  endloop\n endfacet\n";
}

inline std::string text_stl() {
  std::string text = "solid\n";
  for (const auto& face : tetrahedron_faces) text += facet(face);
  return text + "endsolid\n";
}

inline std::string binary_stl(std::string header = "a tetrahedron") {
  header.resize(80, ' ');
  std::string bytes = header + raw(std::uint32_t{4});
  for (const auto& face : tetrahedron_faces) {
    bytes += raw(0.0f) + raw(0.0f) + raw(1.0f);
    for (const int vertex : face)
      for (const float value : tetrahedron_corners[static_cast<std::size_t>(vertex)])
        bytes += raw(value);
    bytes += raw(std::uint16_t{0});
  }
  return bytes;
}

/// A file that must be refused, and why.
struct DamagedMesh {
  Mesh format;
  std::string what;
  std::string bytes;
};

/// A file that must be read, and its content: by default the tetrahedron.
struct TrickyMesh {
  Mesh format;
  std::string what;
  std::string bytes;
  std::size_t vertices = 4;
  std::size_t faces = 4;
  Eigen::Vector3d low{0, 0, 0};
  Eigen::Vector3d high{2, 3, 5};
};

}  // namespace ensonify::tests
