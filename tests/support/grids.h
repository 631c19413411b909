#pragma once

#include <array>
#include <bit>
#include <cstdint>
#include <string>
#include <vector>

namespace ensonify::tests {

/// A small GeoTIFF, uncompressed, one strip, heights in float. Written without GDAL, so that GDAL's
/// reader is checked independently. The heights come last, so that a shortened file lacks some.
struct Tiff {
  std::uint32_t columns = 0;
  std::uint32_t rows = 0;
  std::vector<float> heights;                                        ///< the file's first row first
  std::array<double, 6> transform = {500000, 1, 0, 4000000, 0, -1};  ///< in GDAL's order
  std::uint16_t epsg = 32619;
  bool geographic = false;
  std::string nodata;   ///< none if empty
  bool sparse = false;  ///< no strip

  std::string bytes() const {
    static_assert(std::endian::native == std::endian::little);
    struct Tag {
      std::uint16_t id, type;
      std::string value;
      std::uint32_t count;
    };
    std::vector<Tag> tags;
    const auto shorts = [&](std::uint16_t id, const std::vector<std::uint16_t>& values) {
      tags.push_back({id, 3, raw(values), static_cast<std::uint32_t>(values.size())});
    };
    const auto longs = [&](std::uint16_t id, std::uint32_t value) {
      tags.push_back({id, 4, raw(std::vector{value}), 1});
    };
    const std::string data = sparse ? std::string() : raw(heights);
    longs(256, columns);
    longs(257, rows);
    shorts(258, {32});
    shorts(259, {1});
    shorts(262, {1});
    const std::size_t offset_tag = tags.size();
    longs(273, 0);
    shorts(277, {1});
    longs(278, rows);
    longs(279, sparse ? 0 : columns * rows * 4);
    shorts(339, {3});
    const auto& t = transform;
    tags.push_back(
        {34264, 12,
         raw(std::vector<double>{t[1], t[2], 0, t[0], t[4], t[5], 0, t[3], 0, 0, 0, 0, 0, 0, 0, 1}),
         16});
    shorts(34735, {1, 1, 0, 3,  // directory: model type, pixel is area, coordinate system
                   1024, 0, 1, static_cast<std::uint16_t>(geographic ? 2 : 1), 1025, 0, 1, 1,
                   static_cast<std::uint16_t>(geographic ? 2048 : 3072), 0, 1, epsg});
    if (!nodata.empty())
      tags.push_back({42113, 2, nodata + '\0', static_cast<std::uint32_t>(nodata.size() + 1)});

    const std::size_t directory_bytes = 2 + 12 * tags.size() + 4;
    std::size_t next = 8 + directory_bytes;
    for (const Tag& tag : tags)
      if (tag.value.size() > 4) next += tag.value.size() + tag.value.size() % 2;
    if (!sparse) tags[offset_tag].value = raw(std::vector{static_cast<std::uint32_t>(next)});

    std::string out =
        "II" + raw(std::vector<std::uint16_t>{42}) + raw(std::vector<std::uint32_t>{8});
    std::string extra;
    out += raw(std::vector{static_cast<std::uint16_t>(tags.size())});
    for (const Tag& tag : tags) {
      out += raw(std::vector{tag.id, tag.type}) + raw(std::vector{tag.count});
      std::string value = tag.value;
      if (value.size() > 4) {
        if (value.size() % 2 == 1) value += '\0';
        out += raw(std::vector{static_cast<std::uint32_t>(8 + directory_bytes + extra.size())});
        extra += value;
      } else {
        value.resize(4);
        out += value;
      }
    }
    return out + std::string(4, '\0') + extra + data;
  }

 private:
  template <class T>
  static std::string raw(const std::vector<T>& values) {
    return {reinterpret_cast<const char*>(values.data()), values.size() * sizeof(T)};
  }
};

}  // namespace ensonify::tests
