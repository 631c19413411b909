#include <ensonify/engine/output/npz.h>

#include <bit>
#include <cstdint>
#include <stdexcept>
#include <string>
#include <type_traits>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <ensonify/engine/base/json_text.h>
#include <ensonify/engine/output/archive_writer.h>

namespace ensonify::engine {
namespace {

static_assert(std::endian::native == std::endian::little,
              "values are copied unchanged into NumPy's little-endian types");

void append(std::vector<std::byte>& bytes, std::span<const std::byte> more) {
  bytes.insert(bytes.end(), more.begin(), more.end());
}

/// An array file, NPY version 1.0: magic, header length, a Python dictionary that is padded so that
/// the data begin at a multiple of 64 bytes, and the data.
std::vector<std::byte> npy(std::string_view type, std::string_view shape,
                           std::span<const std::byte> data) {
  std::string header =
      fmt::format("{{'descr': '{}', 'fortran_order': False, 'shape': {}, }}", type, shape);
  constexpr std::size_t before = 10;
  header.append(63 - (before + header.size()) % 64, ' ');
  header += '\n';
  std::string start("\x93NUMPY\x01\x00", 8);
  start += static_cast<char>(header.size() & 0xff);
  start += static_cast<char>(header.size() >> 8);
  std::vector<std::byte> bytes;
  bytes.reserve(before + header.size() + data.size());
  append(bytes, std::as_bytes(std::span(start)));
  append(bytes, std::as_bytes(std::span(header)));
  append(bytes, data);
  return bytes;
}

}  // namespace

void encode_npz(const Waterfall& waterfall, const ImageOrigin& origin,
                const refine::WriteAt& write_at) {
  std::uint64_t place = 0;
  ArchiveWriter zip(ArchiveFormat::zip, "cannot make a NumPy archive",
                    [&](std::span<const std::byte> bytes) {
                      write_at(place, bytes);
                      place += bytes.size();
                    });
  const std::string shape = fmt::format("({}, {})", waterfall.rows(), waterfall.columns());
  BinLayers::for_each([&](std::string_view name, auto layer) {
    if (!origin.has_layer(name)) return;
    const auto& values = waterfall.pixels.*layer;
    using Value = typename std::decay_t<decltype(values)>::value_type;
    zip.add(fmt::format("{}.npy", name), npy(std::is_same_v<Value, float> ? "<f4" : "<u4", shape,
                                             std::as_bytes(std::span(values))));
  });

  nlohmann::ordered_json attributes;
  for (const auto& [name, value] : image_attributes(waterfall, origin))
    std::visit([&, &key = name](const auto& v) { attributes[key] = v; }, value);
  // ASCII, so that one byte becomes one character of a NumPy string (UTF-32).
  const std::string text = ascii_json_text(attributes);
  const std::u32string characters(text.begin(), text.end());
  zip.add("attributes.npy",
          npy(fmt::format("<U{}", characters.size()), "()", std::as_bytes(std::span(characters))));
  zip.finish();
}

std::vector<std::byte> encode_npy(std::span<const double> values, std::size_t rows,
                                  std::size_t columns) {
  if (values.size() != rows * columns)
    throw std::invalid_argument(
        fmt::format("encode_npy: {} values for {} x {}", values.size(), rows, columns));
  return npy("<f8", fmt::format("({}, {})", rows, columns), std::as_bytes(values));
}

}  // namespace ensonify::engine
