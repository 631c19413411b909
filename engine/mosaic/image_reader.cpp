#include <ensonify/engine/mosaic/image_reader.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstring>
#include <optional>
#include <string_view>
#include <utility>

#include <OpenEXR/ImfChannelList.h>
#include <OpenEXR/ImfDoubleAttribute.h>
#include <OpenEXR/ImfFrameBuffer.h>
#include <OpenEXR/ImfHeader.h>
#include <OpenEXR/ImfInputPart.h>
#include <OpenEXR/ImfIntAttribute.h>
#include <OpenEXR/ImfMultiPartInputFile.h>
#include <OpenEXR/ImfPartType.h>
#include <OpenEXR/ImfStringAttribute.h>
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <nlohmann/json.hpp>

#include <ensonify/engine/base/untrusted.h>
#include <ensonify/engine/scene/scene.h>
#include <ensonify/engine/seafloor/seafloor.h>
#include <ensonify/refine/read_file.h>

namespace ensonify::engine {
namespace {

constexpr const char* usual_remedy = "copy the file again, or make the run again";
constexpr const char* another_kind = "this is not an image of a run";
constexpr const char* other_remedy = "give a folder that `ensonify run` wrote";
constexpr int max_columns = 1 << 20;            // more than any scene has
constexpr double max_compression = 2000;        // no method of OpenEXR reaches it
constexpr double max_rows_per_byte = 2.0;       // 32 rows take at least 16 bytes
constexpr double small_block_bytes = 16 << 20;  // memory that any file may take

[[noreturn]] void fail(const std::filesystem::path& file, std::string_view what,
                       std::string_view remedy = usual_remedy) {
  throw SceneError(fmt::format("{}: {}; {}", file.string(), what, remedy));
}

/// The next bytes of a file; zeros behind its end.
std::string next_bytes(refine::FileReader& reader, std::size_t count) {
  std::string bytes(count, '\0');
  reader.read(std::as_writable_bytes(std::span(bytes)));
  return bytes;
}
std::uint32_t next_number(refine::FileReader& reader) {
  std::array<unsigned char, 4> bytes{};
  reader.read(std::as_writable_bytes(std::span(bytes)));
  return bytes[0] | bytes[1] << 8 | bytes[2] << 16 | std::uint32_t{bytes[3]} << 24;
}

/// The types of attributes in a run's images, and the bytes of a value; 0: any number of bytes.
constexpr std::array<std::pair<std::string_view, std::uint32_t>, 9> attribute_types{
    {{"box2i", 16},
     {"chlist", 0},
     {"compression", 1},
     {"double", 8},
     {"float", 4},
     {"int", 4},
     {"lineOrder", 1},
     {"string", 0},
     {"v2f", 8}}};

/// The number of channels in the value of a `chlist` attribute. Each channel is a name, a zero byte
/// and 16 bytes; a zero byte ends the list. Unset if the value is damaged.
std::optional<int> channels_of(const std::string& value) {
  int channels = 0;
  std::size_t at = 0;
  for (; at < value.size() && value[at] != '\0'; ++channels) {
    const std::size_t zero = value.find('\0', at);
    if (zero == value.npos) return std::nullopt;
    at = zero + 1 + 16;
  }
  return at + 1 == value.size() ? std::optional(channels) : std::nullopt;
}

/// The most rows of a block with this number of a compression (OpenEXR, "File Layout").
int block_rows(char compression) {
  constexpr std::string_view single("\0\1\2", 3);  // none, RLE, ZIP of single rows
  constexpr char dwab = 9;
  if (single.find(compression) != single.npos) return 1;
  return compression == dwab ? 256 : 32;
}

/// Checks the sizes in a file's header, because OpenEXR allocates the memory for them before it
/// reads the data. Throws SceneError.
void check_sizes(const std::filesystem::path& file) {
  constexpr std::uint32_t magic = 20000630, tiles_or_parts = 0x1a00;
  refine::FileReader reader(file);
  if (!reader.fault().empty()) fail(file, reader.fault(), other_remedy);
  const auto bytes = static_cast<double>(reader.bytes());
  if (next_number(reader) != magic) fail(file, "this is not an OpenEXR file");
  if (next_number(reader) & tiles_or_parts) fail(file, another_kind, other_remedy);
  std::array<std::int32_t, 4> window{};  // least x and y, greatest x and y
  double channels = 0.0, rows_of_block = 1.0;
  std::string name, type;
  while (reader.next_line(name, '\0') && !name.empty()) {
    reader.next_line(type, '\0');
    const std::uint32_t size = next_number(reader);
    if (size > bytes) fail(file, "the file is truncated");
    const auto* const known =
        std::ranges::find(attribute_types, type, [](const auto& one) { return one.first; });
    if (known == attribute_types.end() || (known->second != 0 && size != known->second))
      fail(file, another_kind, other_remedy);
    const std::string value = next_bytes(reader, size);
    if (name == "dataWindow" && size == sizeof window)
      std::memcpy(window.data(), value.data(), sizeof window);
    if (name == "compression" && size == 1) rows_of_block = block_rows(value[0]);
    if (type != "chlist") continue;
    const std::optional<int> known_channels = channels_of(value);
    if (!known_channels) fail(file, another_kind, other_remedy);
    channels = std::max(channels, static_cast<double>(*known_channels));
  }
  const double columns = static_cast<double>(window[2]) - window[0] + 1.0,
               rows = static_cast<double>(window[3]) - window[1] + 1.0;
  if (rows > max_rows_per_byte * bytes || 2.0 * columns * rows * channels > max_compression * bytes)
    fail(file, "the file is truncated");
  // OpenEXR allocates a whole block, even if the image has fewer rows.
  if (4.0 * columns * rows_of_block * channels >
      std::max(small_block_bytes, max_compression * bytes))
    fail(file, "the file is truncated");
}

}  // namespace

struct ImageReader::Open {
  // This reads the header and, unlike InputFile, does not yet allocate buffers for the columns.
  explicit Open(const std::filesystem::path& path) : file(path.c_str(), 0) {}
  const Imf::Header& header() const { return file.header(0); }

  Imf::MultiPartInputFile file;
  std::optional<Imf::InputPart> part;
  std::size_t rows = 0, columns = 0;
};

ImageReader::ImageReader(const std::filesystem::path& file) : file_(file) {
  std::error_code unknown;
  if (!std::filesystem::exists(file, unknown)) fail(file, "the file is missing");
  check_sizes(file);  // also refuses a named pipe, on which OpenEXR would wait without end
  try {
    open_ = std::make_unique<Open>(file);
    const Imf::Header& header = open_->header();
    const auto& window = header.dataWindow();
    const auto columns = std::int64_t{window.max.x} - window.min.x + 1;
    if (window.min.x != 0 || window.min.y != 0 || columns > max_columns ||
        (header.hasType() && header.type() != Imf::SCANLINEIMAGE))
      fail(file, another_kind, other_remedy);
    if (!open_->file.partComplete(0)) fail(file, "the file is truncated");
    open_->part.emplace(open_->file, 0);
    open_->columns = static_cast<std::size_t>(columns);
    open_->rows = static_cast<std::size_t>(std::int64_t{window.max.y} + 1);
  } catch (const SceneError&) {
    throw;
  } catch (const std::exception& error) {
    fail(file, fmt::format("OpenEXR cannot read it ({})", error.what()));
  }
}

ImageReader::~ImageReader() = default;

std::size_t ImageReader::rows() const { return open_->rows; }
std::size_t ImageReader::columns() const { return open_->columns; }

std::string ImageReader::text(const std::string& attribute) const {
  const auto* found = open_->header().findTypedAttribute<Imf::StringAttribute>(attribute);
  if (!found) fail(file_, fmt::format("the attribute '{}' is missing", attribute));
  return found->value();
}

double ImageReader::number(const std::string& attribute) const {
  if (const auto* real = open_->header().findTypedAttribute<Imf::DoubleAttribute>(attribute))
    return real->value();
  if (const auto* whole = open_->header().findTypedAttribute<Imf::IntAttribute>(attribute))
    return whole->value();
  fail(file_, fmt::format("the attribute '{}' is missing", attribute));
}

std::vector<std::string> ImageReader::names(const std::string& attribute) const {
  const auto list = json_or_null<nlohmann::json>(text(attribute));
  if (!list.is_array() || list.empty() || list.size() > max_labels + 1 ||
      !std::ranges::all_of(list, [](const auto& name) { return name.is_string(); }))
    fail(file_, fmt::format("the attribute '{}' is no list of names", attribute));
  return list.get<std::vector<std::string>>();
}

void ImageReader::read(std::size_t first, std::size_t count, std::span<const std::string> layers,
                       std::span<std::vector<float>> into) {
  Imf::FrameBuffer frame;
  const auto top = static_cast<int>(first);
  for (std::size_t i = 0; i < layers.size(); ++i) {
    if (!open_->header().channels().findChannel(layers[i]))
      fail(file_, fmt::format("the layer '{}' is missing", layers[i]),
           fmt::format("make the run again, without output.layers or with all of {} in it",
                       fmt::join(layers, ", ")));
    into[i].resize(count * columns());
    frame.insert(layers[i], Imf::Slice::Make(Imf::FLOAT, into[i].data(), {0, top},
                                             static_cast<std::int64_t>(columns()),
                                             static_cast<std::int64_t>(count), sizeof(float),
                                             sizeof(float) * columns()));
  }
  try {
    open_->part->setFrameBuffer(frame);
    open_->part->readPixels(top, top + static_cast<int>(count) - 1);
  } catch (const std::exception& error) {
    fail(file_, fmt::format("OpenEXR cannot read rows {} to {} ({})", first, first + count - 1,
                            error.what()));
  }
}

}  // namespace ensonify::engine
