#include <algorithm>
#include <array>
#include <cstdint>
#include <limits>
#include <utility>

#include <fmt/format.h>

#include <ensonify/refine/mesh_formats.h>

namespace ensonify::refine {
namespace {

// Statements that add no polygon. Unknown ones are refused: they may be misspelt vertices.
constexpr std::array ignored{"vt",     "vn",       "vp",         "g",        "o",
                             "s",      "l",        "p",          "mg",       "lod",
                             "bevel",  "c_interp", "d_interp",   "usemtl",   "mtllib",
                             "usemap", "maplib",   "shadow_obj", "trace_obj"};
constexpr std::array free_form{"cstype", "deg", "bmat", "step", "parm", "trim",  "hole",  "scrv",
                               "sp",     "end", "con",  "curv", "surf", "curv2", "ctech", "stech"};

bool is_among(const auto& statements, std::string_view word) {
  return std::ranges::find(statements, word) != statements.end();
}

bool begins_number(std::string_view word) { return word.find_first_of("0123456789+-.") == 0; }

class ObjParser {
 public:
  ObjParser(std::string_view bytes, std::string_view name)
      : text_(bytes, name, {.hash_comments = true, .joined_lines = true}) {}

  FileMesh parse() {
    while (text_.to_word()) {
      const std::string_view statement = text_.word();
      if (statement == "v")
        vertex();
      else if (statement == "f" || statement == "fo")
        face();
      else if (is_among(ignored, statement))
        skip_statement();
      else if (is_among(free_form, statement))
        text_.fail(
            fmt::format("\"{}\" belongs to a free-form surface, which cannot be read; write "
                        "the file again as polygons",
                        statement));
      else
        text_.fail(fmt::format("{} is not a statement of an OBJ file; correct or remove the line",
                               quoted(statement)));
    }
    if (mesh_.faces.empty())
      text_.fail("the file ends without a face (f); write it again with its faces");
    if (highest_ > mesh_.positions.size())
      text_.fail(index_fault(static_cast<std::int64_t>(highest_), mesh_.positions.size()),
                 highest_line_);
    return std::move(mesh_);
  }

 private:
  /// Skips a statement with a name. A backslash at the end of a name joins the next line to this
  /// one, but only if the next line is no vertex and no face.
  void skip_statement() {
    for (;;) {
      const MeshText before = text_;
      const std::string_view word = text_.word();
      if (word.empty()) return;
      MeshText ahead = text_;
      if (text_.line() != before.line() && (word == "v" || word == "f" || word == "fo") &&
          begins_number(ahead.word())) {
        text_ = before;
        return;
      }
    }
  }

  void vertex() {
    Eigen::Vector3d& position = mesh_.positions.emplace_back();
    int numbers = 0;
    for (std::string_view word; !(word = text_.word()).empty(); ++numbers) {
      const double value = text_.coordinate(word);
      if (numbers < 3) position[numbers] = value;
    }
    // A weight, a colour, or both are ignored.
    if (numbers != 3 && numbers != 4 && numbers != 6 && numbers != 7)
      text_.fail(
          fmt::format("a vertex has {} numbers, expected x y z (and a weight, a colour, or "
                      "both); correct the line",
                      numbers));
  }

  void face() {
    Fan fan(mesh_);
    for (std::string_view word; !(word = text_.word()).empty();) fan.add(corner(word));
    if (fan.corners() < 3)
      text_.fail(fmt::format(
          "a face has {} corners, expected 3 or more; correct or remove the line", fan.corners()));
  }

  /// a, a/b, a//c or a/b/c: only a is used; the others must be numbers or missing.
  std::uint32_t corner(std::string_view word) {
    const std::size_t slash = std::min(word.find('/'), word.size());
    const std::int64_t index = text_.integer(word.substr(0, slash), "a vertex's number");
    std::string_view others = word.substr(slash);
    for (int i = 0; i < 2 && !others.empty(); ++i) {
      const std::size_t end = std::min(others.find('/', 1), others.size());
      if (end > 1) text_.integer(others.substr(1, end - 1), "a corner as a, a/b, a//c or a/b/c");
      others.remove_prefix(end);
    }
    if (!others.empty())
      text_.fail(fmt::format("found {}, expected a corner as a, a/b, a//c or a/b/c; correct it",
                             quoted(word)));

    const auto vertices = static_cast<std::int64_t>(mesh_.positions.size());
    if (index == 0 || index < -vertices || index > std::numeric_limits<std::uint32_t>::max())
      text_.fail(index_fault(index, mesh_.positions.size()));
    if (index < 0) return static_cast<std::uint32_t>(vertices + index);
    // The index may be of a later vertex, so it is checked at the end.
    if (static_cast<std::uint64_t>(index) > highest_) {
      highest_ = static_cast<std::uint64_t>(index);
      highest_line_ = text_.line();
    }
    return static_cast<std::uint32_t>(index - 1);
  }

  MeshText text_;
  FileMesh mesh_;
  std::uint64_t highest_ = 0;  ///< the highest vertex number in any face
  std::size_t highest_line_ = 0;
};

}  // namespace

FileMesh parse_obj(std::string_view bytes, std::string_view name) {
  return ObjParser(bytes, name).parse();
}

}  // namespace ensonify::refine
