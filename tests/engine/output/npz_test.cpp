#include <ensonify/engine/output/archive_writer.h>
#include <ensonify/engine/output/npz.h>

#include <sys/mman.h>

#include <cstdlib>
#include <cstring>
#include <span>
#include <stdexcept>
#include <string>

#include <nlohmann/json.hpp>

#include <ensonify/refine/atomic_file.h>

#include "support/catch.h"
#include "support/files.h"
#include "support/sample_waterfall.h"
#include "support/settings.h"
#include "support/temporary_folder.h"
#include "support/written_bytes.h"

using namespace ensonify::engine;
using ensonify::tests::OtherSettings;
using ensonify::tests::read_text;
using ensonify::tests::sample_origin;
using ensonify::tests::sample_waterfall;
using ensonify::tests::TemporaryFolder;

namespace {

/// Python's ZIP reader tests the archive; NumPy, if installed, prints each array as raw bytes.
constexpr const char* script = R"py(
import sys, zipfile
folder = sys.argv[1]
archive = zipfile.ZipFile(folder + '/s.npz')
assert archive.testzip() is None
for info in archive.infolist():
    assert info.date_time == (1980, 1, 1, 0, 0, 0), info
    print('entry', info.filename)
try:
    import numpy
except ImportError:
    print('no numpy')
    sys.exit(0)
arrays = numpy.load(folder + '/s.npz')
for name in arrays.files:
    array = arrays[name]
    if name == 'attributes':
        open(folder + '/attributes.json', 'w').write(array.item())
    else:
        open(folder + '/' + name, 'wb').write(array.tobytes())
        print('array', name, array.dtype, *array.shape)
array = numpy.load(folder + '/a.npy')
print('npy', array.dtype, *array.shape, array[1, 2], array[0, 1])
)py";

std::vector<std::byte> npz(const Waterfall& waterfall, const ImageOrigin& its_origin) {
  return ensonify::tests::written_bytes(
      [&](const auto& write_at) { encode_npz(waterfall, its_origin, write_at); });
}

}  // namespace

TEST_CASE("Python and NumPy read the archive's arrays back, bit by bit") {
  const TemporaryFolder folder;
  const Waterfall waterfall = sample_waterfall();
  ensonify::refine::write_file(folder / "s.npz", npz(waterfall, sample_origin));
  ensonify::refine::write_file(folder / "a.npy",
                               encode_npy(std::vector{1.0, 2.5, 3.0, 4.0, 5.0, -0.125}, 2, 3));
  ensonify::refine::write_file(folder / "read.py", script);
  const std::string path = folder.path().string();
  if (std::system("/usr/bin/python3 --version > /dev/null 2>&1") != 0) {
    WARN("skipped: no /usr/bin/python3 here");
    return;
  }
  REQUIRE(
      std::system(("/usr/bin/python3 '" + path + "/read.py' '" + path + "' > '" + path + "/log'")
                      .c_str()) == 0);
  const std::string log = read_text(folder / "log");
  INFO(log);
  BinLayers::for_each([&](std::string_view name, auto) {
    CHECK(log.find("entry " + std::string(name) + ".npy\n") != std::string::npos);
  });
  CHECK(log.find("entry attributes.npy\n") != std::string::npos);
  if (log.find("no numpy") != std::string::npos) {
    WARN("skipped in part: no numpy here");
    return;
  }
  BinLayers::for_each([&](std::string_view name, auto layer) {
    const auto& values = waterfall.pixels.*layer;
    const bool real = std::is_same_v<decltype(values[0]), const float&>;
    CHECK(log.find("array " + std::string(name) + (real ? " float32" : " uint32") + " 7 66\n") !=
          std::string::npos);
    const std::string bytes = read_text(folder / std::string(name));
    REQUIRE(bytes.size() == values.size() * sizeof values[0]);
    CHECK(std::memcmp(bytes.data(), values.data(), bytes.size()) == 0);
  });
  CHECK(log.find("npy float64 2 3 -0.125 2.5\n") != std::string::npos);

  const auto attributes = nlohmann::json::parse(read_text(folder / "attributes.json"));
  CHECK(attributes["row_order"] == "oldest_first");
  CHECK(attributes["sonar"] == waterfall.sonar.name);
  CHECK(attributes["bins"] == 33);
  CHECK(attributes["world_origin_y_m"] == 6234000.1);
  CHECK(attributes["units_z_m"] == "m");
  CHECK(attributes["scene_hash"] == sample_origin.scene_hash);
  CHECK(attributes["class_names"] == sample_origin.names.classes);
  CHECK(attributes["sediment_names"] == sample_origin.names.materials);
}

TEST_CASE("A NumPy file is laid out as its specification says") {
  const std::vector<double> values = {1.0, 2.0, 3.0, 4.0, 5.0, 6.0};
  const auto bytes = encode_npy(values, 3, 2);
  const std::string text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  CHECK(text.substr(0, 8) == std::string("\x93NUMPY\x01\x00", 8));
  const std::size_t length =
      static_cast<unsigned char>(text[8]) + 256u * static_cast<unsigned char>(text[9]);
  CHECK((10 + length) % 64 == 0);
  CHECK(text[9 + length] == '\n');
  CHECK(text.substr(10).find("{'descr': '<f8', 'fortran_order': False, 'shape': (3, 2), }") == 0);
  REQUIRE(text.size() == 10 + length + 48);
  CHECK(text.substr(10 + length) ==
        std::string(reinterpret_cast<const char*>(values.data()), 48));  // to the bit
  CHECK_THROWS_AS(encode_npy(values, 2, 2), std::invalid_argument);
  // Any length of header is padded to 64.
  for (std::size_t columns : {1u, 10u, 1000u, 100'000u, 1'000'000u}) {
    const auto wide = encode_npy(std::vector<double>(columns), 1, columns);
    CHECK((wide.size() - 8 * columns) % 64 == 0);
  }
}

TEST_CASE("A NumPy archive has the same bytes a second time, and in another time zone and locale") {
  const Waterfall waterfall = sample_waterfall(40, 100);
  const auto bytes = npz(waterfall, sample_origin);
  CHECK(npz(waterfall, sample_origin) == bytes);
  const OtherSettings other;
  CHECK(npz(waterfall, sample_origin) == bytes);
}

TEST_CASE("An archive takes files of more than 2 GiB") {
  // Pages of zeros, which take no memory.
  const std::size_t size = (std::size_t{1} << 31) + 4096;
  void* const zeros =
      mmap(nullptr, size, PROT_READ, MAP_PRIVATE | MAP_ANONYMOUS | MAP_NORESERVE, -1, 0);
  REQUIRE(zeros != MAP_FAILED);
  std::size_t written = 0;
  ArchiveWriter tar(ArchiveFormat::ustar, "cannot make it",
                    [&](std::span<const std::byte> bytes) { written += bytes.size(); });
  CHECK_NOTHROW(tar.add("layer.npy", {static_cast<const std::byte*>(zeros), size}));
  CHECK_NOTHROW(tar.finish());
  CHECK(written > size);
  munmap(zeros, size);
}

TEST_CASE("A NumPy archive reports each piece that cannot be written") {
  const Waterfall waterfall = sample_waterfall();
  CHECK(ensonify::tests::ignored_failures(
            [&](const auto& write_at) { encode_npz(waterfall, sample_origin, write_at); }) == 0);
}

TEST_CASE("A sonar's name that is not UTF-8 still makes a NumPy archive") {
  Waterfall waterfall = sample_waterfall();
  waterfall.sonar.name = "\xff\xfe";
  CHECK_NOTHROW(npz(waterfall, sample_origin));
}
