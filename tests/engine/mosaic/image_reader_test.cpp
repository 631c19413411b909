#include <ensonify/engine/mosaic/image_reader.h>

#include <cstring>
#include <string>

#include <ensonify/engine/scene/scene.h>

#include "support/catch.h"
#include "support/files.h"
#include "support/small_run.h"
#include "support/temporary_folder.h"

using namespace ensonify;

namespace {

/// Writes a number behind a text in a file's bytes.
template <class Number>
std::string with_number(std::string bytes, const std::string& text, std::size_t behind,
                        Number number) {
  const std::size_t at = bytes.find(text);
  REQUIRE(at != std::string::npos);
  std::memcpy(&bytes[at + text.size() + behind], &number, sizeof number);
  return bytes;
}

}  // namespace

TEST_CASE("An image whose header promises more than the file holds is refused") {
  using namespace std::string_literals;
  const tests::TemporaryFolder folder;
  const std::string image = tests::SmallRun().image;
  const std::string window = "dataWindow\0box2i\0"s;
  tests::write_text(folder / "whole.exr", image);
  CHECK(engine::ImageReader(folder / "whole.exr").rows() == 3);
  for (const std::string& wrong :
       {with_number(image, "scene_hash\0string\0"s, 0, 2000000000),
        with_number(image, window, 16, 2000000000), with_number(image, window, 12, 1000000),
        with_number(image, "\x76\x2f\x31\x01"s, 0, 2 | 0x1000)}) {
    tests::write_text(folder / "wrong.exr", wrong);
    CHECK_THROWS_AS(engine::ImageReader(folder / "wrong.exr"), engine::SceneError);
  }
}

TEST_CASE("An image of a few rows does not make room for a block of many long rows") {
  using namespace std::string_literals;
  const tests::TemporaryFolder folder;
  const std::string long_rows =
      with_number(tests::SmallRun().image, "dataWindow\0box2i\0"s, 12, 150000);
  const auto with_compression = [&](char compression) {
    return with_number(long_rows, "compression\0compression\0"s, 4, compression);
  };
  // Single rows are short enough for the file's size, blocks of 32 or 256 rows are not.
  for (const char one_row : {0, 1, 2}) {
    tests::write_text(folder / "rows.exr", with_compression(one_row));
    CHECK(engine::ImageReader(folder / "rows.exr").columns() == 150001);
  }
  for (const char many_rows : {3, 4, 5, 6, 7, 8, 9}) {
    tests::write_text(folder / "blocks.exr", with_compression(many_rows));
    CHECK_THROWS_WITH(engine::ImageReader(folder / "blocks.exr"), Catch::Contains("truncated"));
  }
}
