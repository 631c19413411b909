#include <cstdint>
#include <utility>

#include <fmt/format.h>

#include <ensonify/refine/mesh_formats.h>

namespace ensonify::refine {
namespace {

constexpr std::uint64_t vertex_bytes = 6;  // "0 0 0\n"
constexpr std::uint64_t face_bytes = 8;    // "3 0 1 2\n"

class OffParser {
 public:
  OffParser(std::string_view bytes, std::string_view name)
      : text_(bytes, name, {.hash_comments = true}) {}

  FileMesh parse() {
    header();
    const std::string_view first = text_.next_word("the number of vertices");
    if (first == "BINARY")
      text_.fail("binary OFF cannot be read; write the file again as text, or as PLY");
    const std::uint64_t vertices = count(first, "the number of vertices");
    const std::uint64_t faces =
        count(text_.next_word("the number of faces"), "the number of faces");
    count(text_.next_word("the number of edges"), "the number of edges");
    text_.end_line("the three counts");
    if (faces == 0) text_.fail("the file has no faces; write it again with faces");
    // Compared by division first, so that no product overflows. The last line may have no line end.
    const std::uint64_t left = text_.bytes_left() + 1;
    if (vertices > left / vertex_bytes || faces > left / face_bytes ||
        vertices * vertex_bytes + faces * face_bytes > left)
      text_.fail(
          fmt::format("the file announces {} vertices and {} faces, more than the {} bytes "
                      "that follow can hold; it is cut short or the counts are wrong: fetch "
                      "or write it again",
                      vertices, faces, left - 1));
    mesh_.positions.reserve(vertices);
    mesh_.faces.reserve(faces);
    for (std::uint64_t i = 0; i < vertices; ++i) vertex();
    for (std::uint64_t i = 0; i < faces; ++i) face();
    if (text_.to_word())
      text_.fail(fmt::format("{} follows the last face; correct the counts or remove it",
                             quoted(text_.word())));
    return std::move(mesh_);
  }

 private:
  /// Reads OFF with its prefixes ST, C and N, in any order, for what each vertex has in addition.
  void header() {
    const std::string_view word = text_.next_word("OFF");
    std::string_view more = word.ends_with("OFF") ? word.substr(0, word.size() - 3) : "?";
    for (; !more.empty(); more.remove_prefix(more[0] == 'S' ? 2 : 1)) {
      if (more.starts_with("ST") && !texture_)
        texture_ = true;
      else if (more[0] == 'C' && !colour_)
        colour_ = true;
      else if (more[0] == 'N' && !normal_)
        normal_ = true;
      else
        text_.fail(
            fmt::format("found {}, expected OFF (or COFF, NOFF, STOFF); write the file again "
                        "as OFF in three dimensions",
                        quoted(word)));
    }
  }

  std::uint64_t count(std::string_view word, std::string_view wanted) const {
    const std::int64_t value = text_.integer(word, wanted);
    if (value < 0) text_.fail(fmt::format("{} is {}; correct it", wanted, value));
    return static_cast<std::uint64_t>(value);
  }

  void vertex() {
    Eigen::Vector3d& position = mesh_.positions.emplace_back();
    for (double& value : position) value = text_.coordinate();
    const int fewest = 3 * normal_ + 3 * colour_ + 2 * texture_;  // a colour has 3 numbers or 4
    for (int i = 0; i < fewest; ++i) text_.skip_number();
    if (const std::string_view alpha = colour_ ? text_.word() : ""; !alpha.empty())
      text_.check_number(alpha);
    text_.end_line("a vertex");
  }

  void face() {
    const std::int64_t corners = text_.integer("a face's number of corners");
    if (corners < 3)
      text_.fail(
          fmt::format("a face has {} corners, expected 3 or more; correct or remove it", corners));
    Fan fan(mesh_);
    for (std::int64_t i = 0; i < corners; ++i) {
      const std::int64_t index = text_.integer("a vertex's number");
      if (index < 0 || static_cast<std::uint64_t>(index) >= mesh_.positions.size())
        text_.fail(index_fault(index, mesh_.positions.size()));
      fan.add(static_cast<std::uint32_t>(index));
    }
    // The rest of the line is a colour: an index of a colour map, or three or four numbers.
    int colour = 0;
    for (std::string_view word; !(word = text_.word()).empty(); ++colour) text_.check_number(word);
    if (colour == 2 || colour > 4)
      text_.fail(
          fmt::format("{} numbers follow a face of {} corners, which is not a colour; correct "
                      "its number of corners",
                      colour, corners));
  }

  MeshText text_;
  FileMesh mesh_;
  bool texture_ = false, colour_ = false, normal_ = false;
};

}  // namespace

FileMesh parse_off(std::string_view bytes, std::string_view name) {
  return OffParser(bytes, name).parse();
}

}  // namespace ensonify::refine
