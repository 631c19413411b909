#include "support/catch.h"
#include "support/png_pixels.h"
#include "support/temporary_folder.h"

#include <ensonify/engine/output/masks.h>
#include <ensonify/engine/output/tar.h>

using namespace ensonify::engine;
using ensonify::tests::png_pixels;

TEST_CASE("masks have the layers' numbers, the newest ping on top, without ignored instances") {
  Sonar sonar;
  sonar.bins = 5;
  sonar.sides = Sides::port;
  Waterfall line(sonar, 2);
  BinLayers& layers = line.pixels;
  // The older ping: no data, water, bed, shadow, object 300; the newer one: object 7, ignored, and
  // bed.
  const std::uint32_t regions[10] = {0, 1, 2, 4, 3, 3, 2, 2, 2, 2};
  for (std::size_t i = 0; i < 10; ++i) {
    layers.region[i] = regions[i];
    layers.class_id[i] = regions[i] == 3 ? 4 : 9;
    layers.sediment[i] = 6;
    layers.instance[i] = i == 4 ? 300 : i == 5 ? 7 : 0;
  }
  const Masks encoded = encode_masks(line, {.ignored = {7}});
  const std::vector<Mask>& masks = encoded.files;
  REQUIRE(masks.size() == 4);
  CHECK(masks[0].name == "class");
  CHECK(png_pixels(masks[0].png, false) ==
        std::vector<std::uint16_t>{255, 9, 9, 9, 9, 255, 0, 9, 0, 4});
  CHECK(encoded.class_numbers == std::vector<std::uint16_t>{0, 4, 9, 255});
  CHECK(masks[1].name == "sediment");
  CHECK(png_pixels(masks[1].png, false) ==
        std::vector<std::uint16_t>{255, 6, 6, 6, 6, 255, 255, 6, 255, 6});
  CHECK(masks[2].name == "instance");
  CHECK(png_pixels(masks[2].png, true) ==
        std::vector<std::uint16_t>{65535, 0, 0, 0, 0, 65535, 0, 0, 0, 300});
  CHECK(masks[3].name == "region");
  CHECK(png_pixels(masks[3].png, false) ==
        std::vector<std::uint16_t>{3, 2, 2, 2, 2, 0, 1, 2, 4, 3});
  // The shadow of instance 7 is ignored, and the shadow of instance 300 has a class.
  layers.region[8] = 4;
  layers.shadow_instance[8] = 7;
  layers.shadow_instance[3] = 300;
  const Mask with_shadows =
      encode_masks(line, {.ignored = {7}, .shadow_class = 2, .names = {{"none", "a"}, {}}})
          .files[0];
  CHECK(png_pixels(with_shadows.png, false) ==
        std::vector<std::uint16_t>{255, 9, 9, 255, 9, 255, 0, 9, 2, 4});
  const std::string_view bytes(reinterpret_cast<const char*>(with_shadows.png.data()),
                               with_shadows.png.size());
  CHECK(bytes.find(std::string_view("tEXtnames\0[\"none\",\"a\"]", 22)) != bytes.npos);

  layers.class_id[2] = 255;  // reserved for ignored pixels
  CHECK_THROWS_AS(encode_masks(line, {}), std::invalid_argument);
}

TEST_CASE("a tar returns its members, and does not appear before finish()") {
  const ensonify::tests::TemporaryFolder folder;
  const std::vector<std::byte> one(700, std::byte{7}), two;
  {
    TarFile tar(folder / "a.tar");
    tar.add("000000.one.bin", one);
    CHECK(!std::filesystem::exists(folder / "a.tar"));
    tar.add("000000-tiles-two", two);
    tar.finish();
  }
  {
    TarFile abandoned(folder / "b.tar");
    abandoned.add("x", one);
  }
  CHECK(std::distance(std::filesystem::directory_iterator(folder.path()), {}) == 1);
  std::vector<std::pair<std::string, std::size_t>> found;
  read_tar(folder / "a.tar", [&](const std::string& name, const std::vector<std::byte>& content) {
    found.emplace_back(name, content.size());
  });
  CHECK(found == std::vector<std::pair<std::string, std::size_t>>{{"000000.one.bin", 700},
                                                                  {"000000-tiles-two", 0}});
}
