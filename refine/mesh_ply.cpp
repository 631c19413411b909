#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <optional>
#include <utility>

#include <fmt/format.h>

#include <ensonify/refine/mesh_formats.h>

namespace ensonify::refine {
namespace {

enum class Encoding { text, little_endian, big_endian };
enum class Scalar { int8, uint8, int16, uint16, int32, uint32, float32, float64 };
enum class Role { none, x, y, z, corners };

constexpr std::array<std::size_t, 8> scalar_bytes{1, 1, 2, 2, 4, 4, 4, 8};
bool is_float(Scalar type) { return type == Scalar::float32 || type == Scalar::float64; }
std::size_t scalar_size(Scalar type) { return scalar_bytes[static_cast<std::size_t>(type)]; }

struct Property {
  std::string_view name;
  Scalar type;
  std::optional<Scalar> count_type;  ///< type of the count, if the property is a list
  Role role = Role::none;
};

struct Element {
  std::string_view name;
  std::uint64_t count;
  std::size_t line;  ///< the line of the header with the count
  std::vector<Property> properties;
};

struct PlyHeader {
  Encoding encoding;
  std::vector<Element> elements;
  std::uint64_t vertices;
};

class HeaderParser {
 public:
  explicit HeaderParser(MeshText& text) : text_(text) {}

  PlyHeader parse() {
    if (const std::string_view magic = text_.word(); magic != "ply")
      text_.fail(fmt::format("found {}, expected ply; this is not a PLY file", quoted(magic)));
    text_.end_line("ply");
    for (;;) {
      const std::string_view keyword = text_.next_word("end_header");
      if (keyword == "comment" || keyword == "obj_info") {
        text_.skip_line();
        continue;
      }
      if (keyword == "format")
        format();
      else if (keyword == "element")
        element();
      else if (keyword == "property")
        property();
      else if (keyword != "end_header")
        text_.fail(
            fmt::format("found {}, expected format, element, property, comment or "
                        "end_header; correct the header",
                        quoted(keyword)));
      text_.end_line(keyword);
      if (keyword == "end_header") break;
    }
    if (!encoding_) text_.fail("the header has no format; add one, such as: format ascii 1.0");
    header_.encoding = *encoding_;
    find_vertices();
    find_corners();
    return std::move(header_);
  }

 private:
  void format() {
    constexpr std::array<std::string_view, 3> names{"ascii", "binary_little_endian",
                                                    "binary_big_endian"};
    if (encoding_) text_.fail("the format is given twice; keep one");
    const std::string_view name = text_.word(), version = text_.word();
    const auto found = std::ranges::find(names, name);
    if (found == names.end() || version != "1.0")
      text_.fail(
          fmt::format("the format is {} {}, expected ascii, binary_little_endian or "
                      "binary_big_endian, and 1.0; write the file again",
                      quoted(name), quoted(version)));
    encoding_ = static_cast<Encoding>(found - names.begin());
  }

  void element() {
    const std::string_view name = text_.word();
    const std::int64_t count = text_.integer(text_.word(), "an element's name and count");
    if (count < 0) text_.fail(fmt::format("an element's count is {}; correct it", count));
    if (name == "tristrips")
      text_.fail("triangle strips (tristrips) cannot be read; write the file again with faces");
    header_.elements.push_back({name, static_cast<std::uint64_t>(count), text_.line(), {}});
  }

  void property() {
    if (header_.elements.empty()) text_.fail("a property comes before any element; correct it");
    Property property;
    std::string_view word = text_.word();
    if (word == "list") {
      property.count_type = type(text_.word());
      if (is_float(*property.count_type))
        text_.fail("a list's count is a float; write the file again with counts of uchar");
      word = text_.word();
    }
    property.type = type(word);
    property.name = text_.word();
    if (property.name.empty()) text_.fail("a property has no name; correct the header");
    header_.elements.back().properties.push_back(property);
  }

  Scalar type(std::string_view word) const {
    constexpr std::array<std::string_view, 8> names{"char", "uchar", "short", "ushort",
                                                    "int",  "uint",  "float", "double"};
    constexpr std::array<std::string_view, 8> sized{"int8",  "uint8",  "int16",   "uint16",
                                                    "int32", "uint32", "float32", "float64"};
    for (std::size_t i = 0; i < names.size(); ++i)
      if (word == names[i] || word == sized[i]) return static_cast<Scalar>(i);
    text_.fail(
        fmt::format("found {}, expected a property's type, such as float or int; correct "
                    "the header",
                    quoted(word)));
  }

  /// Returns the item with this name, or null; fails if there are two. (Only names that the reader
  /// uses are looked for. Comparing all names of a header with each other would take too long.)
  template <class Named>
  Named* find(std::vector<Named>& all, std::string_view name, std::size_t line) const {
    const auto found = std::ranges::find(all, name, &Named::name);
    if (found == all.end()) return nullptr;
    if (std::find_if(found + 1, all.end(), [&](const Named& n) { return n.name == name; }) !=
        all.end())
      text_.fail(fmt::format("the header has {} twice; keep one", quoted(name)), line);
    return &*found;
  }

  void find_vertices() {
    Element* const vertex = find(header_.elements, "vertex", text_.line());
    if (!vertex) text_.fail("the header has no element vertex; write the file again with vertices");
    header_.vertices = vertex->count;
    for (const auto& [name, role] : {std::pair{"x", Role::x}, {"y", Role::y}, {"z", Role::z}}) {
      Property* const axis = find(vertex->properties, name, vertex->line);
      if (!axis || axis->count_type)
        text_.fail(
            fmt::format("a vertex has no number {}; write the file again with x, y and z", name),
            vertex->line);
      axis->role = role;
    }
  }

  void find_corners() {
    Element* const face = find(header_.elements, "face", text_.line());
    if (!face || face->count == 0)
      text_.fail("the header has no faces; write the file again with faces",
                 face ? face->line : text_.line());
    Property* const indices = find(face->properties, "vertex_indices", face->line);
    Property* const index = find(face->properties, "vertex_index", face->line);
    if (indices && index) text_.fail("faces have two lists of vertices; keep one", face->line);
    Property* const corners = indices ? indices : index;
    if (!corners || !corners->count_type || is_float(corners->type))
      text_.fail("faces have no list vertex_indices of whole numbers; write the file again with it",
                 face->line);
    corners->role = Role::corners;
  }

  MeshText& text_;
  PlyHeader header_{};
  std::optional<Encoding> encoding_;
};

/// The values after the header, as words.
class TextBody {
 public:
  explicit TextBody(MeshText& text) : text_(text) {}
  double coordinate(Scalar) { return text_.coordinate(); }
  std::int64_t integer(Scalar) { return text_.integer("a whole number"); }
  void skip(Scalar, std::uint64_t count) {
    for (std::uint64_t i = 0; i < count; ++i) text_.skip_number();
  }
  void end_row() { text_.end_line("the element's last value"); }
  void end() {
    if (text_.to_word())
      text_.fail(fmt::format("{} follows the last element; correct the counts or remove it",
                             quoted(text_.word())));
  }
  /// The smallest size of a value, and the bytes left. The last line may have no line end.
  static std::uint64_t fewest_bytes(Scalar) { return 2; }
  std::uint64_t bytes_left() const { return text_.bytes_left() + 1; }
  [[noreturn]] void fail(const std::string& what) const { text_.fail(what); }

 private:
  MeshText& text_;
};

/// The values after the header, as bytes.
class BinaryBody {
 public:
  BinaryBody(std::string_view bytes, std::string_view name, std::size_t place, bool swapped)
      : bytes_(bytes), name_(name), place_(place), swapped_(swapped) {}

  double coordinate(Scalar type) {
    const double value = number(type);
    if (!(std::abs(value) <= largest_mesh_m))
      fail(fmt::format("a coordinate is {}, not a number of metres; write the file again", value));
    return value;
  }
  std::int64_t integer(Scalar type) { return static_cast<std::int64_t>(number(type)); }
  void skip(Scalar type, std::uint64_t count) {
    if (count > bytes_left() / scalar_size(type)) fail_at_end();
    last_ = place_;
    place_ += count * scalar_size(type);
  }
  void end_row() {}
  void end() {
    last_ = place_;
    if (bytes_left() > 0)
      fail(fmt::format("{} bytes follow the last element; correct the counts or remove them",
                       bytes_left()));
  }
  static std::uint64_t fewest_bytes(Scalar type) { return scalar_size(type); }
  std::uint64_t bytes_left() const { return bytes_.size() - place_; }
  [[noreturn]] void fail(const std::string& what) const { fail_at_byte(name_, last_, what); }

 private:
  /// Reads a scalar of any type: values of all types are exact in double.
  double number(Scalar type) {
    switch (type) {
      case Scalar::int8: return load<std::int8_t>();
      case Scalar::uint8: return load<std::uint8_t>();
      case Scalar::int16: return load<std::int16_t>();
      case Scalar::uint16: return load<std::uint16_t>();
      case Scalar::int32: return load<std::int32_t>();
      case Scalar::uint32: return load<std::uint32_t>();
      case Scalar::float32: return load<float>();
      default: return load<double>();
    }
  }

  template <class T>
  T load() {
    if (bytes_left() < sizeof(T)) fail_at_end();
    std::array<char, sizeof(T)> raw;
    std::memcpy(raw.data(), bytes_.data() + place_, sizeof(T));
    if (swapped_) std::ranges::reverse(raw);
    last_ = place_;
    place_ += sizeof(T);
    return std::bit_cast<T>(raw);
  }

  [[noreturn]] void fail_at_end() const {
    fail_at_byte(name_, bytes_.size(),
                 "the file ends within an element; it is cut short: fetch or write it again");
  }

  std::string_view bytes_, name_;
  std::size_t place_, last_ = 0;
  bool swapped_;
};

template <class Body>
void read_corners(Body& body, const Property& property, std::uint64_t vertices, FileMesh& mesh) {
  const std::int64_t corners = body.integer(*property.count_type);
  if (corners < 3)
    body.fail(
        fmt::format("a face has {} corners, expected 3 or more; correct or remove it", corners));
  Fan fan(mesh);
  for (std::int64_t i = 0; i < corners; ++i) {
    const std::int64_t index = body.integer(property.type);
    if (index < 0 || static_cast<std::uint64_t>(index) >= vertices)
      body.fail(index_fault(index, vertices));
    fan.add(static_cast<std::uint32_t>(index));
  }
}

template <class Body>
void read_row(Body& body, const Element& element, std::uint64_t vertices, FileMesh& mesh) {
  Eigen::Vector3d position = Eigen::Vector3d::Zero();
  for (const Property& property : element.properties) {
    switch (property.role) {
      case Role::x: position.x() = body.coordinate(property.type); break;
      case Role::y: position.y() = body.coordinate(property.type); break;
      case Role::z: position.z() = body.coordinate(property.type); break;
      case Role::corners: read_corners(body, property, vertices, mesh); break;
      case Role::none: {
        const std::int64_t count =
            property.count_type ? body.integer(*property.count_type) : std::int64_t{1};
        if (count < 0) body.fail(fmt::format("a list has {} values; correct it", count));
        body.skip(property.type, static_cast<std::uint64_t>(count));
      }
    }
  }
  if (element.name == "vertex") mesh.positions.push_back(position);
  body.end_row();
}

template <class Body>
FileMesh read_body(const PlyHeader& header, const MeshText& text, Body body) {
  FileMesh mesh;
  for (const Element& element : header.elements) {
    if (element.properties.empty()) continue;
    // The smallest size of a row. Counts that the file cannot hold are refused before memory is
    // taken.
    std::uint64_t row_bytes = 0;
    for (const Property& property : element.properties) {
      if (property.role == Role::corners) row_bytes += 3 * body.fewest_bytes(property.type);
      row_bytes += body.fewest_bytes(property.count_type.value_or(property.type));
    }
    if (element.count > body.bytes_left() / row_bytes)
      text.fail(
          fmt::format("the header announces {} of element {}, more than the {} bytes left for "
                      "it can hold; the file is cut short or its header wrong: fetch or "
                      "write it again",
                      element.count, quoted(element.name), body.bytes_left()),
          element.line);
    if (element.name == "vertex") mesh.positions.reserve(element.count);
    if (element.name == "face") mesh.faces.reserve(element.count);
    for (std::uint64_t i = 0; i < element.count; ++i)
      read_row(body, element, header.vertices, mesh);
  }
  body.end();
  return mesh;
}

/// The place after the header. If the header's lines end with CR alone, it ends with one CR, even
/// if the first byte after it is an LF.
std::size_t body_place(std::string_view bytes, std::size_t end_header) {
  const std::size_t first = bytes.find_first_of("\r\n");
  const bool lone_cr = bytes.substr(first, 1) == "\r" && bytes.substr(first, 2) != "\r\n";
  const std::size_t end = bytes.find_first_of("\r\n", end_header);
  if (end == std::string_view::npos) return bytes.size();
  return end + (bytes.substr(end, 2) == "\r\n" && !lone_cr ? 2 : 1);
}

}  // namespace

FileMesh parse_ply(std::string_view bytes, std::string_view name) {
  static_assert(std::endian::native == std::endian::little);
  MeshText text(bytes, name, {});
  const PlyHeader header = HeaderParser(text).parse();
  if (header.encoding == Encoding::text) return read_body(header, text, TextBody(text));
  return read_body(header, text,
                   BinaryBody(bytes, name, body_place(bytes, text.place()),
                              header.encoding == Encoding::big_endian));
}

}  // namespace ensonify::refine
