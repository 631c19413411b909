#include <ensonify/refine/progressive_mesh_file.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <functional>
#include <memory>
#include <new>
#include <stdexcept>
#include <string>
#include <system_error>
#include <type_traits>
#include <utility>
#include <vector>

#include <fcntl.h>
#include <sys/mman.h>
#include <unistd.h>

#include <fmt/format.h>
#include <xxhash.h>

#include <ensonify/refine/atomic_file.h>
#include <ensonify/refine/file_page.h>
#include <ensonify/refine/index.h>
#include <ensonify/refine/mesh_formats.h>
#include <ensonify/refine/read_file.h>

namespace ensonify::refine {
namespace {

using Bytes = std::span<const std::byte>;

enum Section : std::size_t {
  points,
  mid,
  spheres,
  order,
  faces,
  source_face,
  tags,
  roots,
  about,
  checksums,
  section_count
};
constexpr std::array<const char*, section_count> section_names = {
    "points",       "mid",  "spheres", "order", "faces",
    "source faces", "tags", "roots",   "about", "checksums"};

struct Extent {
  std::uint64_t offset, bytes;
  bool operator==(const Extent&) const = default;
};

/// The file's first page, padded with zeros.
struct MeshHeader {
  std::array<char, 8> magic;
  std::uint32_t version, byte_order;
  std::uint64_t checksum;  // of the page, with 0 in this place
  std::uint64_t checksum_of_checksums;
  std::uint64_t leaves, roots, base_faces, source_faces, tags, about_bytes;
  std::array<double, 3> world_origin;
  std::array<float, 3> lowest, highest;
  FileKey key;
  std::array<Extent, section_count> sections;
};
static_assert(sizeof(MeshHeader) == 352 && std::is_trivially_copyable_v<MeshHeader>);
static_assert(sizeof(Sphere) == 16 && sizeof(Face) == 12 && sizeof(Eigen::Vector3f) == 12);

constexpr std::array<char, 8> mesh_magic = file_magic('E', 'P', 'M');
constexpr std::uint32_t other_byte_order = 0x04030201;

/// The places of all sections and checksums in the file, computed from the counts.
class Layout {
 public:
  explicit Layout(const MeshHeader& header) {
    const std::uint64_t nodes = header.leaves - header.roots;
    place(points, {header.leaves, 12}, 0);
    place(mid, {nodes, 4}, 0);
    place(spheres, {nodes, 16}, 0);
    place(order, {nodes, 4}, 0);
    place(faces, {nodes, 24}, 12 * header.base_faces);
    place(source_face, {nodes, 8}, 4 * header.base_faces);
    place(tags, {header.tags, 2}, 0);
    place(roots, {0, 0}, 4 * header.roots);
    place(about, {0, 0}, header.about_bytes);
    place(checksums, {0, 0}, 8 * checksum_count_);
  }

  Extent extent(std::size_t section) const { return extents_[section]; }
  std::uint64_t file_bytes() const { return end_; }
  std::uint64_t groups(std::size_t section) const {
    return (items_[section].count + ProgressiveMesh::group - 1) / ProgressiveMesh::group;
  }
  /// The bytes of a group. The piece after the last group is the section's rest, up to a page's
  /// end.
  Extent piece(std::size_t section, std::uint64_t which) const {
    const auto [count, bytes] = items_[section];
    const std::uint64_t begin = std::min(which * ProgressiveMesh::group, count) * bytes;
    const std::uint64_t end = which == groups(section)
                                  ? page_end(extents_[section].bytes)
                                  : std::min((which + 1) * ProgressiveMesh::group, count) * bytes;
    return {extents_[section].offset + begin, end - begin};
  }
  std::uint64_t checksum_place(std::size_t section, std::uint64_t which) const {
    return first_checksum_[section] + which;
  }

 private:
  struct Items {
    std::uint64_t count, bytes;  // number of items, bytes of each
  };
  void place(std::size_t section, Items items, std::uint64_t rest_bytes) {
    items_[section] = items;
    extents_[section] = {end_, items.count * items.bytes + rest_bytes};
    end_ += page_end(extents_[section].bytes);
    first_checksum_[section] = checksum_count_;
    if (section != checksums) checksum_count_ += groups(section) + 1;
  }

  std::array<Items, section_count> items_{};
  std::array<Extent, section_count> extents_{};
  std::array<std::uint64_t, section_count> first_checksum_{};
  std::uint64_t end_ = page_bytes, checksum_count_ = 0;
};

using Page = std::array<std::byte, page_bytes>;
constexpr Page zeros{};

std::uint64_t checksum_of(Bytes bytes) { return XXH3_64bits(bytes.data(), bytes.size()); }

/// The checksum of bytes and `padding` zeros (less than a page) after them.
std::uint64_t checksum_of(Bytes bytes, std::uint64_t padding) {
  const std::unique_ptr<XXH3_state_t, XXH_errorcode (*)(XXH3_state_t*)> state(XXH3_createState(),
                                                                              XXH3_freeState);
  if (!state) throw std::bad_alloc();
  XXH3_64bits_reset(state.get());
  XXH3_64bits_update(state.get(), bytes.data(), bytes.size());
  XXH3_64bits_update(state.get(), zeros.data(), padding);
  return XXH3_64bits_digest(state.get());
}

Bounds bounds_of(const MeshHeader& header) {
  return {Eigen::Vector3f(header.lowest.data()), Eigen::Vector3f(header.highest.data())};
}

Page page_of(const MeshHeader& header) {
  Page page{};
  std::memcpy(page.data(), &header, sizeof header);
  return page;
}

/// The checksum of the header's page, with 0 in the checksum's place.
std::uint64_t checksum_of(Page page) {
  std::memset(page.data() + offsetof(MeshHeader, checksum), 0, sizeof(MeshHeader::checksum));
  return checksum_of(Bytes(page));
}

// Every hierarchy meets these conditions, on which its users depend. Coordinates are relative to a
// local origin, so they may be twice the largest coordinate of a mesh.
bool is_sound(float coordinate) { return std::abs(coordinate) <= 2.0 * largest_mesh_m; }
bool is_sound(const Eigen::Vector3f& p) {
  return is_sound(p[0]) && is_sound(p[1]) && is_sound(p[2]);
}
bool is_sound(const Sphere& s) {
  return is_sound(s.centre) && s.radius >= 0.0f && s.radius <= 8.0 * largest_mesh_m;
}
bool is_empty(const Face& face, Index source) {
  return face == Face{none, none, none} && source == none;
}
bool is_sound(const Face& face, Index source, std::uint64_t leaves, std::uint64_t source_faces) {
  return face[0] < leaves && face[1] < leaves && face[2] < leaves && source < source_faces;
}

/// Whether `roots` are the first leaves of trees that together have all leaves.
bool are_sound(std::span<const Index> roots, std::uint64_t leaves) {
  return roots.empty() ? leaves == 0
                       : roots.front() == 0 && roots.back() < leaves &&
                             std::ranges::adjacent_find(roots, std::greater_equal()) == roots.end();
}

/// Faces, and the base mesh's half-edges (four per face), have numbers of 32 bits.
bool are_countable(std::uint64_t leaves, std::uint64_t roots, std::uint64_t base_faces) {
  return leaves < std::uint64_t{1} << 31 && roots <= leaves &&
         base_faces < std::uint64_t{1} << 30 && 2 * (leaves - roots) + base_faces < none;
}

/// The bytes of each section; empty for the checksums.
std::array<Bytes, section_count> content(const ProgressiveMesh& mesh,
                                         const ProgressiveMeshExtras& extras) {
  return {std::as_bytes(mesh.points),
          std::as_bytes(mesh.mid),
          std::as_bytes(mesh.spheres),
          std::as_bytes(mesh.order),
          std::as_bytes(mesh.faces),
          std::as_bytes(mesh.source_face),
          std::as_bytes(extras.tags),
          std::as_bytes(mesh.roots),
          std::as_bytes(std::span(extras.about)),
          {}};
}

/// The largest number of a source face, plus one.
std::uint64_t count_source_faces(const ProgressiveMesh& mesh) {
  std::uint64_t count = 0;
  for (const Index source : mesh.source_face)
    if (source != none) count = std::max(count, std::uint64_t{source} + 1);
  return count;
}

/// Throws std::invalid_argument for content that map_progressive_mesh would refuse.
void check_extras(const ProgressiveMesh& mesh, const ProgressiveMeshExtras& extras,
                  std::uint64_t source_faces) {
  const auto require = [](bool holds, const char* what) {
    if (!holds) throw std::invalid_argument(fmt::format("save: {}", what));
  };
  const std::size_t nodes = mesh.mid.size();
  require(nodes + mesh.roots.size() == mesh.points.size() && mesh.spheres.size() == nodes &&
              mesh.order.size() == nodes && mesh.faces.size() >= 2 * nodes &&
              mesh.source_face.size() == mesh.faces.size(),
          "the arrays' sizes do not fit together");
  require(are_countable(mesh.points.size(), mesh.roots.size(), mesh.faces.size() - 2 * nodes),
          "2^31 vertices, or 2^30 faces that were not collapsed; split the mesh");
  require(are_sound(mesh.roots, mesh.points.size()), "roots do not ascend from 0");
  require(mesh.world_origin.allFinite() &&
              std::ranges::all_of(mesh.points, [](const auto& p) { return is_sound(p); }) &&
              std::ranges::all_of(mesh.spheres, [](const auto& s) { return is_sound(s); }),
          "a point or sphere is not finite, or too far away");
  for (std::size_t slot = 0; slot < mesh.faces.size(); ++slot)
    require(is_sound(mesh.faces[slot], mesh.source_face[slot], mesh.points.size(), source_faces) ||
                (slot < 2 * nodes && is_empty(mesh.faces[slot], mesh.source_face[slot])),
            "a face names a vertex that does not exist, or a source face without a tag");
  require(extras.key.size() <= sizeof MeshHeader::key && extras.key.find('\0') == extras.key.npos,
          "a key has at most 64 bytes, none of them 0");
}

MeshHeader header_of(const ProgressiveMesh& mesh, const ProgressiveMeshExtras& extras,
                     std::uint64_t source_faces) {
  MeshHeader header{.magic = mesh_magic,
                    .version = progressive_mesh_version,
                    .byte_order = byte_order,
                    .leaves = mesh.points.size(),
                    .roots = mesh.roots.size(),
                    .base_faces = mesh.faces.size() - 2 * mesh.mid.size(),
                    .source_faces = source_faces,
                    .tags = extras.tags.size(),
                    .about_bytes = extras.about.size()};
  std::copy_n(mesh.world_origin.data(), 3, header.world_origin.begin());
  std::copy_n(mesh.bounds.lowest.data(), 3, header.lowest.begin());
  std::copy_n(mesh.bounds.highest.data(), 3, header.highest.begin());
  std::ranges::copy(extras.key, header.key.begin());
  const Layout layout(header);
  for (std::size_t s = 0; s < section_count; ++s) header.sections[s] = layout.extent(s);
  return header;
}

/// A whole file mapped into memory.
class Mapping {
 public:
  explicit Mapping(const std::filesystem::path& file) {
    const FileReader reader(file);
    if (!reader.fault().empty()) throw MeshError(file.string() + ": " + reader.fault());
    size_ = static_cast<std::size_t>(reader.bytes());
    if (size_ == 0) return;
    void* const at = ::mmap(nullptr, size_, PROT_READ, MAP_SHARED, reader.descriptor(), 0);
    if (at == MAP_FAILED)
      throw MeshError(fmt::format("{}: cannot be opened: {}", file.string(),
                                  std::generic_category().message(errno)));
    data_ = static_cast<const std::byte*>(at);
  }
  ~Mapping() {
    if (data_) ::munmap(const_cast<std::byte*>(data_), size_);
  }
  Mapping(const Mapping&) = delete;
  Mapping& operator=(const Mapping&) = delete;

  Bytes bytes() const { return {data_, data_ ? size_ : 0}; }

 private:
  const std::byte* data_ = nullptr;
  std::size_t size_ = 0;
};

}  // namespace

void save(const ProgressiveMesh& mesh, const ProgressiveMeshExtras& extras,
          const std::filesystem::path& file) {
  mesh.verify_all();
  const std::uint64_t source_faces =
      extras.tags.empty() ? count_source_faces(mesh) : extras.tags.size();
  check_extras(mesh, extras, source_faces);
  MeshHeader header = header_of(mesh, extras, source_faces);
  const Layout layout(header);

  std::array<Bytes, section_count> parts = content(mesh, extras);
  std::vector<std::uint64_t> sums;
  for (std::size_t s = 0; s < checksums; ++s)
    for (std::uint64_t which = 0; which <= layout.groups(s); ++which) {
      const Extent at = layout.piece(s, which);
      const std::uint64_t begin =
          std::min<std::uint64_t>(at.offset - layout.extent(s).offset, parts[s].size());
      const Bytes bytes =
          parts[s].subspan(begin, std::min<std::uint64_t>(at.bytes, parts[s].size() - begin));
      sums.push_back(checksum_of(bytes, at.bytes - bytes.size()));
    }
  const auto padding = [](Bytes bytes) { return page_end(bytes.size()) - bytes.size(); };
  parts[checksums] = std::as_bytes(std::span(sums));
  header.checksum_of_checksums = checksum_of(parts[checksums], padding(parts[checksums]));
  header.checksum = checksum_of(page_of(header));

  const Page first = page_of(header);
  std::vector<Bytes> all = {first};
  for (const Bytes part : parts) {
    all.push_back(part);
    all.push_back(Bytes(zeros).first(padding(part)));
  }
  write_file(file, all);
  // The system keeps the written file in its cache in pieces of megabytes, and touching one page of
  // a piece maps the whole piece. Without this call, a ping over 33 million faces uses five times
  // the memory.
  if (const int written = ::open(file.c_str(), O_RDONLY | O_CLOEXEC); written >= 0) {
    ::posix_fadvise(written, 0, 0, POSIX_FADV_DONTNEED);
    ::close(written);
  }
}

/// A mapped file, with the checks of its sections.
class ProgressiveMesh::File {
 public:
  explicit File(const std::filesystem::path& file)
      : name_(file.string()), mapping_(file), header_(checked_header()), layout_(header_) {
    check_tables();
  }

  const std::string& name() const { return name_; }
  const MeshHeader& header() const { return header_; }
  template <class T>
  std::span<const T> section(std::size_t s) const {
    const auto [offset, bytes] = layout_.extent(s);
    return {reinterpret_cast<const T*>(mapping_.bytes().data() + offset), bytes / sizeof(T)};
  }
  void verify(Kind kind, std::uint64_t which) const {
    const auto part = [&](auto items, std::size_t each) {
      const std::size_t begin = std::min<std::size_t>(which * group * each, items.size());
      return items.subspan(begin, std::min<std::size_t>(group * each, items.size() - begin));
    };
    switch (kind) {
      case Kind::tag: return check_checksum(Section::tags, which);
      case Kind::leaf:
        check_checksum(Section::points, which);
        return require(std::ranges::all_of(part(section<Eigen::Vector3f>(Section::points), 1),
                                           [](const auto& p) { return is_sound(p); }),
                       Section::points, which, "a point is not finite, or too far away");
      case Kind::node: break;
    }
    for (const std::size_t s :
         {Section::mid, Section::spheres, Section::order, Section::faces, Section::source_face})
      check_checksum(s, which);
    require(std::ranges::all_of(part(section<Sphere>(Section::spheres), 1),
                                [](const Sphere& sphere) { return is_sound(sphere); }),
            Section::spheres, which, "a sphere is not finite, or too large");
    const auto slots = section<Face>(Section::faces);
    const auto inner = slots.first(slots.size() - header_.base_faces);
    const auto found = part(inner, 2);
    const auto sources = part(section<Index>(Section::source_face).first(inner.size()), 2);
    for (std::size_t i = 0; i < found.size(); ++i)
      require(is_sound(found[i], sources[i], header_.leaves, header_.source_faces) ||
                  is_empty(found[i], sources[i]),
              Section::faces, which, "a face names a vertex or a source face that does not exist");
  }

 private:
  [[noreturn]] void damaged(std::string_view what) const {
    throw DamagedFile(fmt::format("{}: {}; remove the file and make it again", name_, what));
  }
  /// Unless `holds`, throws DamagedFile with the place of a section's piece, and `what`.
  void require(bool holds, std::size_t section, std::uint64_t which, const char* what) const {
    if (holds) return;
    const auto [offset, bytes] = layout_.piece(section, which);
    damaged(fmt::format("bytes {} to {} ({}): {}", offset, offset + bytes, section_names[section],
                        what));
  }

  MeshHeader checked_header() const {
    const Bytes bytes = mapping_.bytes();
    MeshHeader header{};
    const std::size_t there = std::min(bytes.size(), mesh_magic.size());
    if (there == 0 || std::memcmp(bytes.data(), mesh_magic.data(), there) != 0)
      throw MeshError(fmt::format("{}: not a progressive mesh file; name another", name_));
    if (bytes.size() < page_bytes)
      damaged(fmt::format("ends after {} bytes, within its header", bytes.size()));
    std::memcpy(&header, bytes.data(), sizeof header);
    if (header.byte_order == other_byte_order)
      throw MeshError(fmt::format(
          "{}: from a machine of the other byte order; make it again on this one", name_));
    if (header.byte_order == byte_order && header.version != progressive_mesh_version)
      throw MeshError(
          fmt::format("{}: has version {} of the format, but only {} can be read; make it again",
                      name_, header.version, progressive_mesh_version));
    Page page;
    std::memcpy(page.data(), bytes.data(), page.size());
    const auto require = [&](bool holds, const char* what) {
      if (!holds) damaged(fmt::format("bytes 0 to {} (header): {}", page_bytes, what));
    };
    require(header.byte_order == byte_order && checksum_of(page) == header.checksum,
            "changed after it was written");
    require(are_countable(header.leaves, header.roots, header.base_faces) &&
                header.source_faces < none &&
                (header.tags == 0 || header.tags == header.source_faces) &&
                header.about_bytes <= bytes.size(),
            "counts that no mesh can have");
    const auto [lowest, highest] = bounds_of(header);
    require(Eigen::Vector3d(header.world_origin.data()).allFinite() && is_sound(lowest) &&
                is_sound(highest) && (lowest.array() <= highest.array()).all(),
            "bounds or a world origin that no mesh can have");
    const Layout layout(header);
    if (bytes.size() != layout.file_bytes())
      damaged(fmt::format("has {} bytes, but its header requires {}", bytes.size(),
                          layout.file_bytes()));
    for (std::size_t s = 0; s < section_count; ++s)
      require(header.sections[s] == layout.extent(s), "sections at wrong places");
    return header;
  }

  /// Checks all parts that are used without verifying a node, a leaf or a tag.
  void check_tables() const {
    const auto [offset, bytes] = layout_.extent(checksums);
    if (checksum_of(mapping_.bytes().subspan(offset, page_end(bytes))) !=
        header_.checksum_of_checksums)
      damaged(fmt::format("bytes {} to {} (checksums): changed after they were written", offset,
                          offset + page_end(bytes)));
    for (std::size_t s = 0; s < checksums; ++s) check_checksum(s, layout_.groups(s));
    require(are_sound(section<Index>(Section::roots), header_.leaves), Section::roots, 0,
            "roots do not ascend from 0");
    const auto all = section<Face>(Section::faces);
    const auto sources = section<Index>(Section::source_face);
    for (std::size_t slot = all.size() - header_.base_faces; slot < all.size(); ++slot)
      require(is_sound(all[slot], sources[slot], header_.leaves, header_.source_faces),
              Section::faces, layout_.groups(Section::faces),
              "a face names a vertex or a source face that does not exist");
  }

  void check_checksum(std::size_t s, std::uint64_t which) const {
    const auto [offset, bytes] = layout_.piece(s, which);
    require(checksum_of(mapping_.bytes().subspan(offset, bytes)) ==
                section<std::uint64_t>(checksums)[layout_.checksum_place(s, which)],
            s, which, "changed after they were written");
  }

  std::string name_;
  Mapping mapping_;
  MeshHeader header_;
  Layout layout_;
};

ProgressiveMesh::ProgressiveMesh(std::shared_ptr<const File> file) : file_(std::move(file)) {
  const MeshHeader& header = file_->header();
  points = file_->section<Eigen::Vector3f>(Section::points);
  mid = file_->section<Index>(Section::mid);
  spheres = file_->section<Sphere>(Section::spheres);
  order = file_->section<Index>(Section::order);
  faces = file_->section<Face>(Section::faces);
  source_face = file_->section<Index>(Section::source_face);
  roots = file_->section<Index>(Section::roots);
  tags_ = file_->section<std::uint16_t>(Section::tags);
  const auto text = file_->section<char>(Section::about);
  about_ = {text.data(), text.size()};
  key_ = text_of(header.key);
  world_origin = Eigen::Vector3d(header.world_origin.data());
  bounds = bounds_of(header);
  make_flags(false);
}

void ProgressiveMesh::verify_group(Kind kind, std::size_t which) const {
  file_->verify(kind, which);
  flags_[static_cast<std::size_t>(kind)][which].store(1, std::memory_order_release);
}

void ProgressiveMesh::contradicts(std::string_view what, std::uint32_t number) const {
  throw DamagedFile(fmt::format("{}: its hierarchy contradicts itself: {} {}; make it again",
                                file_ ? file_->name() : "progressive mesh", what, number));
}

ProgressiveMesh map_progressive_mesh(const std::filesystem::path& file) {
  return ProgressiveMesh(std::make_shared<const ProgressiveMesh::File>(file));
}

bool is_progressive_mesh(const std::filesystem::path& file) {
  return begins_with(file, {mesh_magic.data(), mesh_magic.size()});
}

}  // namespace ensonify::refine
