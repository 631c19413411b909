#include <ensonify/engine/output/npz.h>

#include <bit>
#include <cstdint>
#include <exception>
#include <memory>
#include <stdexcept>
#include <string>
#include <type_traits>

#include <archive.h>
#include <archive_entry.h>
#include <fmt/format.h>
#include <nlohmann/json.hpp>

namespace ensonify::engine {
namespace {

static_assert(std::endian::native == std::endian::little,
              "values are copied unchanged into NumPy's little-endian types");

void append(std::vector<std::byte>& bytes, std::span<const std::byte> more) {
  bytes.insert(bytes.end(), more.begin(), more.end());
}

/// NPY version 1.0: magic, header length, a Python dictionary padded so that the data begin at a
/// multiple of 64 bytes.
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

/// A ZIP archive without times or owners.
class Zip {
 public:
  explicit Zip(const refine::WriteAt& write_at)
      : write_at_(write_at), archive_(archive_write_new(), archive_write_free) {
    if (!archive_) throw std::bad_alloc();
    check(archive_write_set_format_zip(archive_.get()));
    // Speckle hardly compresses: level 6 takes three times as long and saves 2 %.
    check(archive_write_set_options(archive_.get(),
                                    "zip:compression=deflate,zip:compression-level=1"));
    check(archive_write_set_bytes_per_block(archive_.get(), 0));
    check(archive_write_open(archive_.get(), this, nullptr, write, nullptr));
  }

  void add(const std::string& name, std::span<const std::byte> data) {
    const std::unique_ptr<archive_entry, decltype(&archive_entry_free)> entry(archive_entry_new(),
                                                                              archive_entry_free);
    if (!entry) throw std::bad_alloc();
    archive_entry_set_pathname(entry.get(), name.c_str());
    archive_entry_set_filetype(entry.get(), AE_IFREG);
    archive_entry_set_perm(entry.get(), 0644);
    archive_entry_set_size(entry.get(), static_cast<la_int64_t>(data.size()));
    check(archive_write_header(archive_.get(), entry.get()));
    const bool whole = archive_write_data(archive_.get(), data.data(), data.size()) ==
                       static_cast<la_ssize_t>(data.size());
    check(whole ? ARCHIVE_OK : ARCHIVE_FATAL);
  }

  void finish() { check(archive_write_close(archive_.get())); }

 private:
  /// Keeps the first error for check(): an exception must not pass through C code, and libarchive
  /// leaks memory if it is told of an error.
  static la_ssize_t write(archive*, void* its_zip, const void* data, std::size_t size) {
    Zip& zip = *static_cast<Zip*>(its_zip);
    try {
      if (!zip.error_) zip.write_at_(zip.place_, {static_cast<const std::byte*>(data), size});
      zip.place_ += size;
    } catch (...) {
      zip.error_ = std::current_exception();
    }
    return static_cast<la_ssize_t>(size);
  }
  void check(int result) const {
    if (error_) std::rethrow_exception(error_);
    if (result == ARCHIVE_OK) return;
    const char* reason = archive_error_string(archive_.get());
    throw std::runtime_error(
        fmt::format("cannot make a NumPy archive: {}", reason ? reason : "no memory left"));
  }

  // Before archive_, whose destructor may still write.
  const refine::WriteAt& write_at_;
  std::uint64_t place_ = 0;
  std::exception_ptr error_;
  std::unique_ptr<archive, decltype(&archive_write_free)> archive_;
};

}  // namespace

void encode_npz(const Waterfall& waterfall, const ImageOrigin& origin,
                const refine::WriteAt& write_at) {
  Zip zip(write_at);
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
  const std::string text =
      attributes.dump(-1, ' ', true, nlohmann::ordered_json::error_handler_t::replace);
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
