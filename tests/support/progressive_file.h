#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstring>
#include <string>

#include <xxhash.h>

namespace ensonify::tests {

/// The bytes of a saved progressive mesh. A test changes some bytes and then corrects the
/// checksums. This class shares no code with the library: it follows the description of the format
/// in refine/progressive_mesh_file.h. A damaged header is allowed: correct_checksums() then passes
/// over what lies outside the file.
class ProgressiveFile {
 public:
  static constexpr std::size_t page = 4096, group = 1024;
  // Offsets in the header, bytes.
  static constexpr std::size_t version = 8, byte_order = 12, checksum = 16, checksum_of_sums = 24,
                               leaves = 32, roots = 40, base_faces = 48, source_faces = 56,
                               tags = 64, about_bytes = 72, world_origin = 80, lowest = 104,
                               highest = 116, key = 128, sections = 192, header_bytes = 352;
  enum Section { points, mid, spheres, order, faces, source_face, tag, root, about, sums };

  std::string bytes;

  template <class T>
  T get(std::size_t offset) const {
    T value{};
    if (offset <= bytes.size() && sizeof value <= bytes.size() - offset)
      std::memcpy(&value, bytes.data() + offset, sizeof value);
    return value;
  }
  template <class T>
  void put(std::size_t offset, T value) {
    if (offset <= bytes.size() && sizeof value <= bytes.size() - offset)
      std::memcpy(bytes.data() + offset, &value, sizeof value);
  }
  std::size_t offset_of(std::size_t section) const {
    return get<std::uint64_t>(sections + 16 * section);
  }
  std::size_t bytes_of(std::size_t section) const {
    return get<std::uint64_t>(sections + 16 * section + 8);
  }

  /// Makes all checksums fit the present bytes.
  void correct_checksums() {
    const std::uint64_t inner = get<std::uint64_t>(leaves) - get<std::uint64_t>(roots);
    const std::array<std::uint64_t, 9> count = {
        get<std::uint64_t>(leaves), inner, inner, inner, inner, inner,
        get<std::uint64_t>(tags),   0,     0};
    constexpr std::array<std::size_t, 9> size = {12, 4, 16, 4, 24, 8, 2, 0, 0};
    std::size_t next = offset_of(sums);
    for (std::size_t s = 0; s < count.size(); ++s) {
      if (count[s] > bytes.size()) continue;
      const std::size_t grouped = count[s] * size[s], step = group * size[s];
      for (std::size_t at = 0; at < grouped; at += step, next += 8)
        put(next, hash(offset_of(s) + at, std::min(step, grouped - at)));
      put(next, hash(offset_of(s) + grouped, rounded(bytes_of(s)) - grouped));
      next += 8;
    }
    put(checksum_of_sums, hash(offset_of(sums), rounded(bytes_of(sums))));
    put(checksum, std::uint64_t{0});
    put(checksum, hash(0, page));
  }

 private:
  static std::size_t rounded(std::size_t size) { return (size + page - 1) / page * page; }
  std::uint64_t hash(std::size_t offset, std::size_t size) const {
    if (offset > bytes.size() || size > bytes.size() - offset) return 0;
    return XXH3_64bits(bytes.data() + offset, size);
  }
};

}  // namespace ensonify::tests
