#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include <Eigen/Core>

#include <ensonify/refine/triangle_mesh.h>

// What the four parsers behind mesh_reader.h share. Nothing here is meant for others.
namespace ensonify::refine {

/// A mesh as it stands in a file: world metres.
struct FileMesh {
  std::vector<Eigen::Vector3d> positions;
  std::vector<Face> faces;
};

/// Each takes a whole file; `name` stands for it in messages. Coordinates come out finite and
/// within largest_mesh_m, indices in range, and at least one face. Throws MeshError.
FileMesh parse_ply(std::string_view bytes, std::string_view name);
FileMesh parse_obj(std::string_view bytes, std::string_view name);
FileMesh parse_stl(std::string_view bytes, std::string_view name);
FileMesh parse_off(std::string_view bytes, std::string_view name);

constexpr double largest_mesh_m = 1e18;  ///< as the intersectors have it

/// Fans one polygon from its first corner into triangles, corner by corner.
class Fan {
 public:
  explicit Fan(std::vector<Face>& faces) : faces_(faces) {}
  void add(std::uint32_t vertex) {
    if (corners_ == 0) first_ = vertex;
    if (corners_ >= 2) faces_.push_back({first_, previous_, vertex});
    previous_ = vertex;
    ++corners_;
  }
  std::size_t corners() const { return corners_; }

 private:
  std::vector<Face>& faces_;
  std::uint32_t first_ = 0, previous_ = 0;
  std::size_t corners_ = 0;
};

/// What somebody's file says, fit for a message: short and printable.
std::string quoted(std::string_view text);

/// Throws MeshError for a binary file, whose places are bytes.
[[noreturn]] void fail_at_byte(std::string_view name, std::size_t byte, const std::string& what);

/// What to say of an index out of range.
std::string index_fault(std::int64_t index, std::uint64_t vertices);

/// Takes a text file apart into words and lines, whatever ends its lines (LF, CR, CRLF), after a
/// byte-order mark or not. Numbers are read in the C locale's way; a leading '+' is allowed.
/// Failures carry the line.
class MeshText {
 public:
  struct Rules {
    bool hash_comments = false;  ///< '#' begins a comment that ends with its line
    bool joined_lines = false;   ///< a line that ends in a backslash goes on in the next
  };
  MeshText(std::string_view bytes, std::string_view name, Rules rules);

  /// The next word of this line, empty at its end.
  std::string_view word();
  /// The next word, on a later line if this one has none; fails at the end of the file.
  std::string_view next_word(std::string_view wanted);
  /// Goes on to the next word's line; false at the end of the file.
  bool to_word();
  /// Fails where this line holds another word.
  void end_line(std::string_view after);
  void skip_line();

  double coordinate();  ///< the next word as a number in metres
  std::int64_t integer(std::string_view wanted);
  void skip_number();  ///< nan and inf are numbers here

  /// A word of this line as one of those.
  double coordinate(std::string_view word) const;
  std::int64_t integer(std::string_view word, std::string_view wanted) const;
  void check_number(std::string_view word) const;

  std::size_t place() const { return place_; }  ///< the byte after the last word
  std::size_t line() const { return line_; }
  std::uint64_t bytes_left() const { return bytes_.size() - place_; }
  /// Throws MeshError with the line of the last word, or with another.
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
