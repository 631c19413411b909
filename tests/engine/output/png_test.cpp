#include <ensonify/engine/output/png.h>

#include <cstring>
#include <stdexcept>
#include <string>

#include <png.h>

#include "support/catch.h"
#include "support/settings.h"

using namespace ensonify::engine;
using ensonify::tests::OtherSettings;

namespace {

Picture sample_picture(std::size_t width, std::size_t height, int channels) {
  Picture picture{width, height, channels, {}};
  for (std::size_t i = 0; i < width * height * static_cast<std::size_t>(channels); ++i)
    picture.pixels.push_back(static_cast<std::uint8_t>(i * i / 7));
  return picture;
}

}  // namespace

TEST_CASE("A PNG has the picture's pixels, in grey and in colour") {
  for (const int channels : {1, 3}) {
    const Picture picture = sample_picture(37, 11, channels);
    const auto bytes = encode_png(picture);
    png_image image = {};
    image.version = PNG_IMAGE_VERSION;
    REQUIRE(png_image_begin_read_from_memory(&image, bytes.data(), bytes.size()));
    CHECK(image.width == 37);
    CHECK(image.height == 11);
    CHECK(image.format == (channels == 1 ? PNG_FORMAT_GRAY : PNG_FORMAT_RGB));
    std::vector<std::uint8_t> pixels(PNG_IMAGE_SIZE(image));
    REQUIRE(png_image_finish_read(&image, nullptr, pixels.data(), 0, nullptr));
    CHECK(pixels == picture.pixels);
  }
}

TEST_CASE("A PNG is complete, and has no chunk with time or text") {
  const auto bytes = encode_png(sample_picture(300, 200, 3));
  const std::string text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  CHECK(text.substr(0, 8) == "\x89PNG\r\n\x1a\n");
  std::string chunks;
  for (std::size_t place = 8; place + 12 <= text.size();) {
    std::size_t length = 0;
    for (std::size_t i = 0; i < 4; ++i)
      length = length << 8 | static_cast<unsigned char>(text[place + i]);
    chunks += text.substr(place + 4, 4) + ' ';
    place += 12 + length;
    if (place == text.size()) chunks += "end";
  }
  INFO(chunks);
  CHECK(chunks.find("IHDR ") == 0);
  CHECK(chunks.ends_with("IEND end"));
  for (const char* name : {"tIME", "tEXt", "zTXt", "iTXt"})
    CHECK(chunks.find(name) == std::string::npos);
}

TEST_CASE("A PNG has the same bytes a second time, and in another time zone and locale") {
  const Picture picture = sample_picture(100, 50, 1);
  const auto bytes = encode_png(picture);
  CHECK(encode_png(picture) == bytes);
  const OtherSettings other;
  CHECK(encode_png(picture) == bytes);
}

TEST_CASE("A picture whose pixels do not fit its size is refused") {
  Picture picture = sample_picture(10, 10, 1);
  CHECK_THROWS_AS(encode_png(Picture{}), std::invalid_argument);
  picture.channels = 2;
  CHECK_THROWS_AS(encode_png(picture), std::invalid_argument);
  picture.channels = 3;
  CHECK_THROWS_AS(encode_png(picture), std::invalid_argument);
  picture = sample_picture(2'000'000, 1, 1);  // wider than libpng allows
  CHECK_THROWS_AS(encode_png(picture), std::runtime_error);
}

TEST_CASE("A PNG of 16 bits has the pixels with the high byte first, in grey and in colour") {
  for (const int channels : {1, 3}) {
    Picture picture = sample_picture(2 * 37, 11, channels);  // bytes
    picture.width = 37;
    picture.bits = 16;
    const auto bytes = encode_png(picture);
    // IHDR: width, height, bits, colour type.
    CHECK(static_cast<int>(bytes.at(24)) == 16);
    CHECK(static_cast<int>(bytes.at(25)) == (channels == 1 ? 0 : 2));
    struct Source {
      const std::vector<std::byte>& bytes;
      std::size_t place;
    } source{bytes, 0};
    png_structp png = png_create_read_struct(PNG_LIBPNG_VER_STRING, nullptr, nullptr, nullptr);
    png_infop info = png_create_info_struct(png);
    png_set_read_fn(png, &source, [](png_structp reader, png_bytep to, png_size_t count) {
      auto& from = *static_cast<Source*>(png_get_io_ptr(reader));
      std::memcpy(to, from.bytes.data() + from.place, count);
      from.place += count;
    });
    png_read_png(png, info, PNG_TRANSFORM_IDENTITY, nullptr);
    CHECK(png_get_bit_depth(png, info) == 16);
    const std::size_t row_bytes = 37 * 2 * static_cast<std::size_t>(channels);
    REQUIRE(png_get_rowbytes(png, info) == row_bytes);
    for (std::size_t row = 0; row < 11; ++row)
      CHECK(std::memcmp(png_get_rows(png, info)[row], picture.pixels.data() + row * row_bytes,
                        row_bytes) == 0);
    png_destroy_read_struct(&png, &info, nullptr);
  }
}

TEST_CASE("A PNG that is too short for its pixels is refused before they are made") {
  auto bytes = encode_png(sample_picture(37, 11, 1));
  CHECK(decode_png(bytes).pixels == sample_picture(37, 11, 1).pixels);
  // A million columns and rows, with the checksum of such a header.
  const std::string header("\x00\x0f\x42\x40\x00\x0f\x42\x40\x08\x00\x00\x00\x00", 13);
  std::uint32_t checksum = 0xffffffff;
  for (const char c : "IHDR" + header) {
    checksum ^= static_cast<unsigned char>(c);
    for (int bit = 0; bit < 8; ++bit)
      checksum = checksum & 1 ? checksum >> 1 ^ 0xedb88320 : checksum >> 1;
  }
  std::memcpy(&bytes[16], header.data(), header.size());
  for (std::size_t i = 0; i < 4; ++i)
    bytes[29 + i] = static_cast<std::byte>(~checksum >> (24 - 8 * i));
  CHECK_THROWS_WITH(decode_png(bytes), Catch::Contains("too short for its pixels"));
}
