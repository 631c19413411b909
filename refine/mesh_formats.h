#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include <Eigen/Core>

#include <ensonify/refine/triangle_mesh.h>

// Common parts of the four parsers that mesh_reader.h uses; not for other users.
namespace ensonify::refine {

/// A mesh as read from a file, in world metres.
struct FileMesh {
  std::vector<Eigen::Vector3d> positions;
  std::vector<Face> faces;
  /// The faces of a polygon with more than three corners: number of the first one, and their count.
  struct Polygon {
    std::size_t first, faces;
  };
  std::vector<Polygon> polygons;
};

/// Each function parses a whole file; `name` is the file's name for messages. In the result,
/// coordinates are finite and within largest_mesh_m, indices are in range, and there is at least
/// one face. Throws MeshError.
FileMesh parse_ply(std::string_view bytes, std::string_view name);
FileMesh parse_obj(std::string_view bytes, std::string_view name);
FileMesh parse_stl(std::string_view bytes, std::string_view name);
FileMesh parse_off(std::string_view bytes, std::string_view name);

constexpr double largest_mesh_m = 1e18;  ///< the limit of the intersectors

/// Splits one polygon into a fan of triangles from its first corner, corner by corner.
class Fan {
 public:
  explicit Fan(FileMesh& mesh) : mesh_(mesh) {}
  void add(std::uint32_t vertex) {
    if (corners_ == 0) first_ = vertex;
    if (corners_ >= 2) mesh_.faces.push_back({first_, previous_, vertex});
    if (corners_ == 3) mesh_.polygons.push_back({mesh_.faces.size() - 2, 1});
    if (corners_ >= 3) ++mesh_.polygons.back().faces;
    previous_ = vertex;
    ++corners_;
  }
  std::size_t corners() const { return corners_; }

 private:
  FileMesh& mesh_;
  std::uint32_t first_ = 0, previous_ = 0;
  std::size_t corners_ = 0;
};

/// Replaces the fan of each concave polygon by as many other triangles, because a fan covers more
/// than a concave polygon. A polygon that crosses itself stays a fan. Throws MeshError for a
/// concave polygon with too many corners.
void split_concave_polygons(FileMesh& mesh, std::string_view name);

/// Text from a file for a message: shortened and printable.
std::string quoted(std::string_view text);

/// Throws MeshError for a fault in a binary file, at this byte.
[[noreturn]] void fail_at_byte(std::string_view name, std::size_t byte, const std::string& what);

/// The message for an index out of range.
std::string index_fault(std::int64_t index, std::uint64_t vertices);

/// Splits a text file into words and lines. Lines may end with LF, CR or CRLF; a byte-order mark is
/// skipped. Numbers are read as in the C locale; a leading '+' is allowed. Errors name the line.
class MeshText {
 public:
  struct Rules {
    bool hash_comments = false;  ///< '#' begins a comment up to the end of the line
    bool joined_lines = false;   ///< a line that ends in a backslash continues on the next
  };
  MeshText(std::string_view bytes, std::string_view name, Rules rules);

  /// The next word of this line, empty at the line's end.
  std::string_view word();
  /// The next word of this line or a later one. Fails at the file's end; the message has `wanted`.
  std::string_view next_word(std::string_view wanted);
  /// Moves to the line with the next word; returns false at the end of the file.
  bool to_word();
  /// Fails if this line has another word after `after`.
  void end_line(std::string_view after);
  void skip_line();

  double coordinate();  ///< the next word as a number in metres
  std::int64_t integer(std::string_view wanted);
  void skip_number();  ///< accepts nan and inf

  /// These read a given word of this line.
  double coordinate(std::string_view word) const;
  std::int64_t integer(std::string_view word, std::string_view wanted) const;
  void check_number(std::string_view word) const;

  std::size_t place() const { return place_; }  ///< the byte after the last word
  std::size_t line() const { return line_; }
  std::uint64_t bytes_left() const { return bytes_.size() - place_; }
  /// Throws MeshError with the line of the last word, or with `line`.
  [[noreturn]] void fail(const std::string& what) const { fail(what, line_); }
  [[noreturn]] void fail(const std::string& what, std::size_t line) const;

 private:
  std::size_t line_end_bytes(std::size_t place) const;
  std::size_t joint_bytes() const;

  std::string_view bytes_, name_;
  Rules rules_;
  std::size_t place_ = 0;
  std::size_t line_ = 1;
};

}  // namespace ensonify::refine
