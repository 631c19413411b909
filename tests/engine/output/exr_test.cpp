#include <ensonify/engine/output/exr.h>

#include <cmath>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <iterator>
#include <random>
#include <string>
#include <type_traits>

#include <OpenEXR/ImfChannelList.h>
#include <OpenEXR/ImfDoubleAttribute.h>
#include <OpenEXR/ImfFrameBuffer.h>
#include <OpenEXR/ImfHeader.h>
#include <OpenEXR/ImfInputFile.h>
#include <OpenEXR/ImfIntAttribute.h>
#include <OpenEXR/ImfOutputFile.h>
#include <OpenEXR/ImfRgbaFile.h>
#include <OpenEXR/ImfStringAttribute.h>

#include <ensonify/refine/atomic_file.h>

#include "support/catch.h"
#include "support/sample_waterfall.h"
#include "support/settings.h"
#include "support/temporary_folder.h"
#include "support/written_bytes.h"

using namespace ensonify::engine;
using ensonify::tests::OtherSettings;
using ensonify::tests::sample_origin;
using ensonify::tests::sample_waterfall;
using ensonify::tests::TemporaryFolder;
using ensonify::tests::written_bytes;

namespace {

std::vector<std::byte> exr(const Waterfall& waterfall, const ImageOrigin& its_origin) {
  return written_bytes([&](const auto& write_at) { encode_exr(waterfall, its_origin, write_at); });
}

void write_exr(const std::filesystem::path& file, const Waterfall& waterfall,
               const ImageOrigin& its_origin) {
  ensonify::refine::write_file(file, exr(waterfall, its_origin));
}

}  // namespace

TEST_CASE("OpenEXR reads every layer back, bit by bit, and the attributes") {
  const TemporaryFolder folder;
  const Waterfall waterfall = sample_waterfall();
  write_exr(folder / "s.exr", waterfall, sample_origin);

  Imf::InputFile file((folder / "s.exr").c_str(), 0);
  const Imf::Header& header = file.header();
  CHECK(header.dataWindow().min == Imath::V2i(0, 0));
  CHECK(header.dataWindow().max == Imath::V2i(65, 6));
  CHECK(header.compression() == Imf::RLE_COMPRESSION);

  int layers = 0, channels = 0;
  for (auto c = header.channels().begin(); c != header.channels().end(); ++c) ++channels;
  BinLayers read;
  read.assign(waterfall.rows() * waterfall.columns());
  Imf::FrameBuffer frame;
  BinLayers::for_each([&](std::string_view name, auto layer) {
    ++layers;
    auto& values = read.*layer;
    using Value = typename std::decay_t<decltype(values)>::value_type;
    const Imf::Channel* channel = header.channels().findChannel(std::string(name));
    REQUIRE(channel);
    const auto type = std::is_same_v<Value, float> ? Imf::FLOAT : Imf::UINT;
    CHECK(channel->type == type);
    frame.insert(std::string(name), Imf::Slice(type, reinterpret_cast<char*>(values.data()),
                                               sizeof(Value), sizeof(Value) * waterfall.columns()));
  });
  CHECK(channels == layers);
  file.setFrameBuffer(frame);
  file.readPixels(0, static_cast<int>(waterfall.rows()) - 1);
  BinLayers::for_each([&](std::string_view name, auto layer) {
    INFO(name);
    const auto& was = waterfall.pixels.*layer;
    const auto& is = read.*layer;
    CHECK(std::memcmp(was.data(), is.data(), was.size() * sizeof was[0]) == 0);
  });

  const auto text = [&](const char* name) {
    return header.typedAttribute<Imf::StringAttribute>(name).value();
  };
  const auto real = [&](const char* name) {
    return header.typedAttribute<Imf::DoubleAttribute>(name).value();
  };
  CHECK(text("row_order") == "oldest_first");
  CHECK(text("sonar") == waterfall.sonar.name);
  CHECK(text("scene_hash") == sample_origin.scene_hash);
  CHECK(text("class_names") == R"(["none","mine","pot \"A\""])");
  CHECK(text("sediment_names") == R"(["none","sandy mud"])");
  CHECK(text("units_intensity") == "uPa^2");
  CHECK(text("units_x_m") == "m");
  CHECK(text("units_grazing_rad") == "rad");
  CHECK(real("frequency_hz") == 455e3);
  CHECK(real("range_m") == 16.5);
  CHECK(header.typedAttribute<Imf::IntAttribute>("bins").value() == 33);
  CHECK(real("world_origin_x_m") == 148376.25);
  CHECK(real("world_origin_y_m") == 6234000.1);
  CHECK(real("world_origin_z_m") == -0.5);
  BinLayers::for_each([&](std::string_view name, auto) {
    CHECK_FALSE(text(("units_" + std::string(name)).c_str()).empty());
  });

  if (std::system("exrheader --help > /dev/null 2>&1") == 127 << 8)
    WARN("skipped: no exrheader here");
  else {
    const std::string command = "exrheader '" + (folder / "s.exr").string() + "' > '" +
                                (folder / "header.txt").string() + "'";
    CHECK(std::system(command.c_str()) == 0);
    std::ifstream stream(folder / "header.txt");
    const std::string printed{std::istreambuf_iterator<char>(stream), {}};
    CHECK(printed.find("row_order (type string): \"oldest_first\"") != std::string::npos);
    CHECK(printed.find("capDate") == std::string::npos);
  }
}

TEST_CASE("An EXR's preview is what viewers of pictures show, oldest ping on top") {
  const TemporaryFolder folder;
  const Waterfall waterfall = sample_waterfall();
  Picture picture{waterfall.columns(), waterfall.rows(), 1, {}};
  for (std::size_t i = 0; i < picture.width * picture.height; ++i)
    picture.pixels.push_back(static_cast<std::uint8_t>(37 * i));
  ImageOrigin with_preview = sample_origin;
  with_preview.preview = [&] { return picture; };
  write_exr(folder / "s.exr", waterfall, with_preview);

  // The interface with which viewers read pictures. It knows no layer but the colours.
  Imf::RgbaInputFile file((folder / "s.exr").c_str(), 0);
  std::vector<Imf::Rgba> pixels(picture.pixels.size());
  file.setFrameBuffer(pixels.data(), 1, picture.width);
  file.readPixels(0, static_cast<int>(picture.height) - 1);
  std::size_t wrong = 0;
  for (std::size_t row = 0; row < picture.height; ++row)
    for (std::size_t column = 0; column < picture.width; ++column) {
      const Imf::Rgba& pixel = pixels[(picture.height - 1 - row) * picture.width + column];
      const double linear = pixel.g;
      const double shown =
          linear <= 0.0031308 ? 12.92 * linear : 1.055 * std::pow(linear, 1 / 2.4) - 0.055;
      wrong += std::lround(255.0 * shown) != picture.pixels[row * picture.width + column];
      wrong += pixel.r != pixel.g || pixel.b != pixel.g;
    }
  CHECK(wrong == 0);

  // The layers are unchanged.
  Imf::InputFile layers((folder / "s.exr").c_str(), 0);
  CHECK(layers.header().channels().findChannel("Y")->type == Imf::HALF);
  std::vector<float> range_m(picture.pixels.size());
  Imf::FrameBuffer frame;
  frame.insert("range_m", Imf::Slice(Imf::FLOAT, reinterpret_cast<char*>(range_m.data()),
                                     sizeof(float), sizeof(float) * picture.width));
  layers.setFrameBuffer(frame);
  layers.readPixels(0, static_cast<int>(picture.height) - 1);
  CHECK(std::memcmp(range_m.data(), waterfall.pixels.range_m.data(),
                    range_m.size() * sizeof range_m[0]) == 0);

  with_preview.preview = [&] { return Picture{1, 1, 1, {0}}; };
  CHECK_THROWS_AS(exr(waterfall, with_preview), std::invalid_argument);
}

TEST_CASE("An EXR has the bytes that OpenEXR makes of its pixels") {
  const TemporaryFolder folder;
  const auto bytes_of = [](const std::filesystem::path& file) {
    std::ifstream stream(file, std::ios::binary);
    return std::string{std::istreambuf_iterator<char>(stream), {}};
  };
  std::mt19937 random(1);
  for (const int bins : {1, 2, 3, 5, 16, 31, 64, 333}) {
    CAPTURE(bins);
    Sonar sonar;
    sonar.bins = bins;
    sonar.sides = bins % 2 == 0 ? Sides::both : Sides::port;
    Waterfall waterfall(sonar, bins == 1 ? 2000 : 40);
    // Rows differ in the mean length of equal values, and in which of their bytes change.
    BinLayers::for_each([&](std::string_view, auto layer) {
      for (std::size_t row = 0; row < waterfall.rows(); ++row)
        for (std::size_t column = 0; column < waterfall.columns(); ++column) {
          auto& values = waterfall.pixels.*layer;
          const std::size_t pixel = row * waterfall.columns() + column;
          static_assert(sizeof values[0] == sizeof(std::uint32_t));
          const std::size_t kind = row % 40;
          constexpr std::uint32_t changed[] = {0xffffffff, 0xff, 0xff00, 0xffff0000, 0x3030303, 0};
          std::uint32_t bits = random() & changed[kind % 6];
          if (column > 0 && random() % (1 + 3 * kind * kind / 10) != 0)
            std::memcpy(&bits, &values[pixel - 1], sizeof bits);
          std::memcpy(&values[pixel], &bits, sizeof bits);
        }
    });
    ImageOrigin with_preview = sample_origin;
    if (bins % 3 == 0)
      with_preview.preview = [&] {
        return Picture{waterfall.columns(), waterfall.rows(), 1,
                       std::vector<std::uint8_t>(waterfall.rows() * waterfall.columns(), 99)};
      };
    write_exr(folder / "ours.exr", waterfall, with_preview);
    Imf::InputFile ours((folder / "ours.exr").c_str(), 0);
    Imf::FrameBuffer frame;
    BinLayers::for_each([&](std::string_view name, auto layer) {
      auto& values = waterfall.pixels.*layer;
      const std::string channel(name);
      frame.insert(channel, Imf::Slice(ours.header().channels()[channel].type,
                                       reinterpret_cast<char*>(values.data()), sizeof values[0],
                                       sizeof values[0] * waterfall.columns()));
    });
    std::vector<std::uint16_t> preview(waterfall.rows() * waterfall.columns());
    if (with_preview.preview) {
      Imf::FrameBuffer of_preview;
      const Imf::Slice slice(Imf::HALF, reinterpret_cast<char*>(preview.data()), 2,
                             2 * waterfall.columns());
      of_preview.insert("Y", slice);
      ours.setFrameBuffer(of_preview);
      ours.readPixels(0, static_cast<int>(waterfall.rows()) - 1);
      frame.insert("Y", slice);
    }
    {
      Imf::OutputFile theirs((folder / "theirs.exr").c_str(), ours.header());
      theirs.setFrameBuffer(frame);
      theirs.writePixels(static_cast<int>(waterfall.rows()));
    }
    CHECK(bytes_of(folder / "ours.exr") == bytes_of(folder / "theirs.exr"));
  }
}

TEST_CASE("An EXR has the same bytes a second time, and in another time zone and locale") {
  const Waterfall waterfall = sample_waterfall(40, 100);
  const auto bytes = exr(waterfall, sample_origin);
  CHECK(exr(waterfall, sample_origin) == bytes);
  const OtherSettings other;
  CHECK(exr(waterfall, sample_origin) == bytes);
}

TEST_CASE("An EXR reports each piece that cannot be written, also when it is closed") {
  const Waterfall waterfall = sample_waterfall(40, 1000);
  CHECK(ensonify::tests::ignored_failures(
            [&](const auto& write_at) { encode_exr(waterfall, sample_origin, write_at); }) == 0);
}

TEST_CASE("An EXR without pixels is refused") {
  CHECK_THROWS_AS(exr(Waterfall(Sonar{}, 0), sample_origin), std::invalid_argument);
}
