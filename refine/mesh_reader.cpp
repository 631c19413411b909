#include <ensonify/refine/mesh_reader.h>

#include <algorithm>
#include <bit>
#include <cctype>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <fstream>
#include <string>
#include <string_view>
#include <vector>

#include <fmt/format.h>

#include <ensonify/refine/atomic_file.h>

namespace ensonify::refine {
namespace {

static_assert(std::endian::native == std::endian::little, "bytes are copied as they are");

constexpr std::size_t vertex_bytes = 3 * sizeof(double);
constexpr std::size_t face_bytes = 1 + 3 * sizeof(std::int32_t);
constexpr std::size_t longest_header = 4096;
constexpr double largest_m = 1e18;  // as the intersectors have it; also refuses NaN

constexpr const char* cure = "write it again with `ensonify seafloor`";

/// What somebody's header says, fit for a message: short and printable.
std::string quoted(std::string_view text) {
  std::string shown(text.substr(0, 60));
  for (char& c : shown)
    if (!std::isprint(static_cast<unsigned char>(c))) c = '?';
  return '"' + shown + (text.size() > 60 ? "...\"" : "\"");
}

struct Header {
  std::uint64_t vertices = 0;
  std::uint64_t faces = 0;
  std::size_t size = 0;  ///< where the body begins
};

/// Takes a header apart line by line; every line but comments must be the one that write_ply writes.
class HeaderReader {
 public:
  HeaderReader(const std::filesystem::path& file, std::string_view text)
      : file_(file), text_(text) {}

  Header read() {
    Header header;
    expect("ply");
    expect("format binary_little_endian 1.0");
    header.vertices = expect_count("element vertex");
    expect("property double x");
    expect("property double y");
    expect("property double z");
    header.faces = expect_count("element face");
    expect("property list uchar int vertex_indices");
    expect("end_header");
    header.size = place_;
    return header;
  }

 private:
  [[noreturn]] void fail(const std::string& what) const {
    throw MeshError(fmt::format("{}:{}: {}; {}", file_.string(), line_, what, cure));
  }

  std::string_view next_line() {
    for (;;) {
      ++line_;
      const std::size_t end = text_.find('\n', place_);
      if (end == std::string_view::npos)
        fail(fmt::format("the header has no end_header within {} bytes", text_.size()));
      const std::string_view line = text_.substr(place_, end - place_);
      place_ = end + 1;
      if (line_ == 1 ||
          !(line == "comment" || line.starts_with("comment ") || line.starts_with("obj_info ")))
        return line;
    }
  }

  void expect(std::string_view wanted) {
    const std::string_view line = next_line();
    if (line != wanted) fail(fmt::format("found {}, expected \"{}\"", quoted(line), wanted));
  }

  std::uint64_t expect_count(std::string_view wanted) {
    const std::string_view line = next_line();
    std::uint64_t count = 0;
    if (line.starts_with(wanted) && line.size() > wanted.size() && line[wanted.size()] == ' ') {
      const char* end = line.data() + line.size();
      const auto read = std::from_chars(line.data() + wanted.size() + 1, end, count);
      if (read.ec == std::errc{} && read.ptr == end) return count;
    }
    fail(fmt::format("found {}, expected \"{} COUNT\"", quoted(line), wanted));
  }

  const std::filesystem::path& file_;
  std::string_view text_;
  std::size_t place_ = 0;
  int line_ = 0;
};

template <class T>
T load(const std::vector<char>& bytes, std::size_t place) {
  T value;
  std::memcpy(&value, bytes.data() + place, sizeof value);
  return value;
}

template <class T>
void append(std::string& bytes, T value) {
  bytes.append(reinterpret_cast<const char*>(&value), sizeof value);
}

}  // namespace

TriangleMesh read_ply(const std::filesystem::path& file) {
  const auto fail = [&](const std::string& what) {
    throw MeshError(fmt::format("{}: {}", file.string(), what));
  };
  // Before it is opened: a named pipe would wait for ever.
  std::error_code unknown;
  if (!std::filesystem::is_regular_file(file, unknown))
    fail("is not a file that can be read; correct the path");
  std::ifstream stream(file, std::ios::binary | std::ios::ate);
  const auto size = static_cast<std::int64_t>(stream.tellg());
  if (!stream || size < 0) fail("cannot be opened; check its permissions");
  const auto file_bytes = static_cast<std::uint64_t>(size);

  const auto read_at = [&](std::size_t place, std::uint64_t count) {
    std::vector<char> bytes(count);
    stream.seekg(static_cast<std::streamoff>(place));
    if (!stream.read(bytes.data(), static_cast<std::streamsize>(count)))
      fail("cannot be read to its end; check the disk");
    return bytes;
  };
  const std::vector<char> head = read_at(0, std::min<std::uint64_t>(file_bytes, longest_header));
  const Header header = HeaderReader(file, {head.data(), head.size()}).read();

  // Divisions first, so that no promise overflows; only then is memory asked for.
  const std::uint64_t body_bytes = file_bytes - header.size;
  if (header.vertices > body_bytes / vertex_bytes || header.faces > body_bytes / face_bytes ||
      header.vertices * vertex_bytes + header.faces * face_bytes > body_bytes)
    fail(
        fmt::format("byte {}: the header promises {} vertices and {} faces, more than the {} bytes "
                    "that follow it; the file is truncated or its header wrong, {}",
                    header.size, header.vertices, header.faces, body_bytes, cure));
  const std::uint64_t used_bytes = header.vertices * vertex_bytes + header.faces * face_bytes;
  if (used_bytes < body_bytes)
    fail(fmt::format("byte {}: {} bytes follow the last face; {}", header.size + used_bytes,
                     body_bytes - used_bytes, cure));
  const std::vector<char> body = read_at(header.size, body_bytes);

  const auto coordinate = [&](std::size_t vertex, std::size_t axis) {
    return load<double>(body, vertex * vertex_bytes + axis * sizeof(double));
  };
  Eigen::Vector3d low = Eigen::Vector3d::Constant(largest_m), high = -low;
  for (std::size_t i = 0; i < header.vertices; ++i)
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const double value = coordinate(i, axis);
      if (!(std::abs(value) <= largest_m))
        fail(fmt::format("byte {}: {} of vertex {} is {}, not a place in metres; {}",
                         header.size + i * vertex_bytes + axis * sizeof(double), "xyz"[axis], i,
                         value, cure));
      const auto a = static_cast<Eigen::Index>(axis);
      low[a] = std::min(low[a], value);
      high[a] = std::max(high[a], value);
    }

  TriangleMesh mesh;
  if (header.vertices > 0) mesh.world_origin = (0.5 * (low + high)).array().round();
  mesh.positions.reserve(header.vertices);
  for (std::size_t i = 0; i < header.vertices; ++i) {
    const Eigen::Vector3d world(coordinate(i, 0), coordinate(i, 1), coordinate(i, 2));
    mesh.positions.emplace_back((world - mesh.world_origin).cast<float>());
  }
  mesh.faces.resize(header.faces);
  for (std::size_t i = 0; i < header.faces; ++i) {
    const std::size_t place = header.vertices * vertex_bytes + i * face_bytes;
    if (const int corners = load<std::uint8_t>(body, place); corners != 3)
      fail(fmt::format("byte {}: face {} has {} corners, expected 3; {}", header.size + place, i,
                       corners, cure));
    for (std::size_t k = 0; k < 3; ++k) {
      const std::size_t corner_place = place + 1 + k * sizeof(std::int32_t);
      const auto vertex = load<std::int32_t>(body, corner_place);
      if (vertex < 0 || static_cast<std::uint64_t>(vertex) >= header.vertices)
        fail(fmt::format("byte {}: face {} names vertex {}, but there are {}; {}",
                         header.size + corner_place, i, vertex, header.vertices, cure));
      mesh.faces[i][k] = static_cast<std::uint32_t>(vertex);
    }
  }
  return mesh;
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
  bytes.reserve(bytes.size() + mesh.positions.size() * vertex_bytes +
                mesh.faces.size() * face_bytes);
  for (const Eigen::Vector3f& position : mesh.positions) {
    const Eigen::Vector3d world = mesh.world_origin + position.cast<double>();
    for (const double value : world) append(bytes, value);
  }
  for (const Face& face : mesh.faces) {
    append(bytes, std::uint8_t{3});
    for (const std::uint32_t vertex : face) append(bytes, static_cast<std::int32_t>(vertex));
  }
  write_file(file, bytes);
}

}  // namespace ensonify::refine
