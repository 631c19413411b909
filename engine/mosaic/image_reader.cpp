#include <ensonify/engine/mosaic/image_reader.h>

#include <cstdint>
#include <optional>
#include <string_view>

#include <OpenEXR/ImfChannelList.h>
#include <OpenEXR/ImfDoubleAttribute.h>
#include <OpenEXR/ImfFrameBuffer.h>
#include <OpenEXR/ImfHeader.h>
#include <OpenEXR/ImfInputPart.h>
#include <OpenEXR/ImfIntAttribute.h>
#include <OpenEXR/ImfMultiPartInputFile.h>
#include <OpenEXR/ImfPartType.h>
#include <OpenEXR/ImfStringAttribute.h>
#include <OpenEXR/ImfTestFile.h>
#include <fmt/format.h>

#include <ensonify/engine/scene/scene.h>

namespace ensonify::engine {
namespace {

constexpr const char* cure = "copy the file again, or make the run again";
constexpr int most_columns = 1 << 20;  // more than any scene's

[[noreturn]] void fail(const std::filesystem::path& file, std::string_view what,
                       std::string_view remedy = cure) {
  throw SceneError(fmt::format("{}: {}; {}", file.string(), what, remedy));
}

}  // namespace

struct ImageReader::Open {
  // The header is read before the buffers for its columns are made, which InputFile would do at
  // once.
  explicit Open(const std::filesystem::path& path) : file(path.c_str(), 0) {}
  const Imf::Header& header() const { return file.header(0); }

  Imf::MultiPartInputFile file;
  std::optional<Imf::InputPart> part;
  std::size_t rows = 0, columns = 0;
};

ImageReader::ImageReader(const std::filesystem::path& file) : file_(file) {
  // Before it is opened: a named pipe would wait for ever.
  std::error_code unknown;
  if (!std::filesystem::is_regular_file(file, unknown)) fail(file, "the file is missing");
  if (!Imf::isOpenExrFile(file.c_str())) fail(file, "this is not an OpenEXR file");
  try {
    open_ = std::make_unique<Open>(file);
    const Imf::Header& header = open_->header();
    const auto& window = header.dataWindow();
    const auto columns = std::int64_t{window.max.x} - window.min.x + 1;
    if (window.min.x != 0 || window.min.y != 0 || columns > most_columns ||
        (header.hasType() && header.type() != Imf::SCANLINEIMAGE))
      fail(file, "this is not an image of a run", "give a folder that `ensonify run` wrote");
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

void ImageReader::read(std::size_t first, std::size_t count, std::span<const std::string> layers,
                       std::span<std::vector<float>> into) {
  Imf::FrameBuffer frame;
  const auto top = static_cast<int>(first);
  for (std::size_t i = 0; i < layers.size(); ++i) {
    if (!open_->header().channels().findChannel(layers[i]))
      fail(file_, fmt::format("the layer '{}' is missing", layers[i]));
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
