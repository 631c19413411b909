#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <unordered_map>

#include <fmt/format.h>

#include <ensonify/refine/mesh_formats.h>

namespace ensonify::refine {
namespace {

constexpr std::size_t header_bytes = 80;
constexpr std::size_t first_facet = header_bytes + sizeof(std::uint32_t);
constexpr std::size_t facet_bytes = 50;   // normal, three corners, two bytes of attributes
constexpr std::size_t first_corner = 12;  // within a facet, after its normal

/// Makes one vertex of equal corners; vertices are numbered in the order of first appearance.
class Welder {
 public:
  explicit Welder(std::vector<Eigen::Vector3d>& positions) : positions_(positions) {}

  std::uint32_t vertex(Eigen::Vector3d corner) {
    corner.array() += 0.0;  // -0 becomes 0
    const Key key{std::bit_cast<std::uint64_t>(corner.x()),
                  std::bit_cast<std::uint64_t>(corner.y()),
                  std::bit_cast<std::uint64_t>(corner.z())};
    const auto [found, is_new] =
        vertices_.try_emplace(key, static_cast<std::uint32_t>(positions_.size()));
    if (is_new) positions_.push_back(corner);
    return found->second;
  }

 private:
  using Key = std::array<std::uint64_t, 3>;
  struct Hash {
    std::size_t operator()(const Key& key) const {
      std::uint64_t hash = 0;
      for (const std::uint64_t bits : key) {
        hash = (hash ^ bits) * 0x9e3779b97f4a7c15u;
        hash ^= hash >> 32;  // because round numbers differ only in their high bits
      }
      return hash;
    }
  };
  std::vector<Eigen::Vector3d>& positions_;
  std::unordered_map<Key, std::uint32_t, Hash> vertices_;
};

std::uint32_t promised_facets(std::string_view bytes) {
  std::uint32_t count = 0;
  std::memcpy(&count, bytes.data() + header_bytes, sizeof count);
  return count;
}

char lower(char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c + 'a' - 'A') : c; }

/// Whether a word is the keyword, in any case.
bool is(std::string_view word, std::string_view keyword) {
  return std::ranges::equal(word, keyword, {}, lower);
}

FileMesh parse_binary(std::string_view bytes, std::string_view name) {
  if (bytes.size() < first_facet)
    fail_at_byte(name, bytes.size(),
                 fmt::format("the file ends, but an STL begins with \"solid\" or with {} bytes; it "
                             "is cut short or not an STL: fetch or write it again",
                             first_facet));
  const std::uint64_t facets = promised_facets(bytes);
  const std::uint64_t promised_bytes = first_facet + facets * facet_bytes;
  if (promised_bytes != bytes.size())
    fail_at_byte(
        name, header_bytes,
        fmt::format("the header announces {} facets, {} bytes in all, but the file has {}; "
                    "it is damaged or not an STL: fetch or write it again",
                    facets, promised_bytes, bytes.size()));
  if (facets == 0)
    fail_at_byte(name, header_bytes, "the file has no facets; write it again with facets");

  FileMesh mesh;
  Welder welder(mesh.positions);
  mesh.faces.resize(facets);
  for (std::size_t i = 0; i < facets; ++i)
    for (std::size_t k = 0; k < 3; ++k) {
      std::array<float, 3> corner;
      const std::size_t place = first_facet + i * facet_bytes + first_corner + k * sizeof corner;
      std::memcpy(corner.data(), bytes.data() + place, sizeof corner);
      for (std::size_t axis = 0; axis < 3; ++axis)
        if (!(std::abs(corner[axis]) <= largest_mesh_m))
          fail_at_byte(name, place + axis * sizeof(float),
                       fmt::format("{} of a corner is {}, not a number of metres; write the file "
                                   "again",
                                   "xyz"[axis], corner[axis]));
      mesh.faces[i][k] = welder.vertex({corner[0], corner[1], corner[2]});
    }
  return mesh;
}

FileMesh parse_text(std::string_view bytes, std::string_view name) {
  MeshText text(bytes, name, {});
  const auto expect = [&](std::string_view keyword) {
    if (const std::string_view word = text.next_word(keyword); !is(word, keyword))
      text.fail(fmt::format("found {}, expected {}; correct it", quoted(word), keyword));
  };
  FileMesh mesh;
  Welder welder(mesh.positions);
  const auto facet = [&] {
    expect("normal");
    for (int i = 0; i < 3; ++i) text.skip_number();
    expect("outer");
    expect("loop");
    Face& face = mesh.faces.emplace_back();
    for (std::uint32_t& vertex : face) {
      expect("vertex");
      Eigen::Vector3d corner;
      for (double& value : corner) value = text.coordinate();
      vertex = welder.vertex(corner);
    }
    expect("endloop");
    expect("endfacet");
  };
  while (text.to_word()) {  // a file may hold several solids
    expect("solid");
    text.skip_line();  // its name
    std::string_view word;
    while (is(word = text.next_word("facet or endsolid"), "facet")) facet();
    if (!is(word, "endsolid"))
      text.fail(fmt::format("found {}, expected facet or endsolid; correct it", quoted(word)));
    text.skip_line();
  }
  if (mesh.faces.empty()) text.fail("the file ends without a facet; write it again with facets");
  return mesh;
}

}  // namespace

FileMesh parse_stl(std::string_view bytes, std::string_view name) {
  // Some binary files begin with "solid", so the size decides; a zero byte in the header
  // distinguishes a damaged binary file from text.
  const bool whole_binary =
      bytes.size() >= first_facet &&
      bytes.size() == first_facet + std::uint64_t{promised_facets(bytes)} * facet_bytes;
  const bool zeros = bytes.substr(0, first_facet).find('\0') != std::string_view::npos;
  MeshText text(bytes, name, {});
  const bool solid = text.to_word() && is(text.word(), "solid");
  return solid && !zeros && !whole_binary ? parse_text(bytes, name) : parse_binary(bytes, name);
}

}  // namespace ensonify::refine
