#include <ensonify/refine/mesh_reader.h>

#include <algorithm>
#include <cctype>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <fstream>
#include <iterator>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include <sys/stat.h>

#include "support/catch.h"
#include "support/temporary_folder.h"

using namespace ensonify::refine;
using ensonify::tests::TemporaryFolder;

namespace {

const std::string header =
    "ply\n"
    "format binary_little_endian 1.0\n"
    "element vertex 4\n"
    "property double x\n"
    "property double y\n"
    "property double z\n"
    "element face 2\n"
    "property list uchar int vertex_indices\n"
    "end_header\n";

template <class T>
std::string bytes_of(T value) {
  std::string bytes(sizeof value, '\0');
  std::memcpy(bytes.data(), &value, sizeof value);
  return bytes;
}

/// A unit square at a place, written without the code under test.
std::string square(double x = 0.0, double y = 0.0) {
  std::string bytes = header;
  for (const auto& [dx, dy] : {std::pair{0.0, 0.0}, {1.0, 0.0}, {1.0, 1.0}, {0.0, 1.0}})
    bytes += bytes_of(x + dx) + bytes_of(y + dy) + bytes_of(-20.25);
  for (const Face& face : {Face{0, 1, 2}, Face{0, 2, 3}}) {
    bytes += '\3';
    for (const std::uint32_t vertex : face) bytes += bytes_of(vertex);
  }
  return bytes;
}

std::string replaced(std::string bytes, const std::string& from, const std::string& to) {
  const std::size_t place = bytes.find(from);
  REQUIRE(place != std::string::npos);
  return bytes.replace(place, from.size(), to);
}

std::string patched(std::size_t place_in_body, const std::string& with) {
  return square().replace(header.size() + place_in_body, with.size(), with);
}

std::string content(const std::filesystem::path& file) {
  std::ifstream stream(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(stream), {}};
}

/// The reader's complaint about these bytes: with the file, and a place, and soon.
void check_refused(const std::string& bytes, const std::string& expected) {
  const TemporaryFolder folder;
  const std::filesystem::path file = folder / "damaged.ply";
  std::ofstream(file, std::ios::binary) << bytes;
  const auto start = std::chrono::steady_clock::now();
  try {
    read_ply(file);
    FAIL("was read; expected: " << expected);
  } catch (const MeshError& error) {
    const std::string what = error.what();
    INFO(what);
    CHECK(what.find(file.string() + ":") == 0);
    const std::string place = what.substr(file.string().size());
    CHECK((std::isdigit(static_cast<unsigned char>(place.at(1))) || place.find(": byte ") == 0));
    CHECK(what.find(expected) != std::string::npos);
    CHECK(what.find('\n') == std::string::npos);
    CHECK(what.size() < 500);
  }
  CHECK(std::chrono::steady_clock::now() - start < std::chrono::seconds(1));
}

}  // namespace

TEST_CASE("A PLY of the documented layout is read, comments and all") {
  const TemporaryFolder folder;
  const std::string commented = replaced(square(148376.0, 6234000.0), "element vertex",
                                         "comment by hand\ncomment\nelement vertex");
  std::ofstream(folder / "square.ply", std::ios::binary) << commented;
  const TriangleMesh mesh = read_ply(folder / "square.ply");
  REQUIRE(mesh.positions.size() == 4);
  CHECK(mesh.faces == std::vector<Face>{{0, 1, 2}, {0, 2, 3}});
  // The middle of the bounds, rounded to whole metres.
  CHECK(mesh.world_origin == Eigen::Vector3d(148377.0, 6234001.0, -20.0));
  CHECK(mesh.positions[0] == Eigen::Vector3f(-1.0f, -1.0f, -0.25f));
  CHECK(mesh.positions[2] == Eigen::Vector3f(0.0f, 0.0f, -0.25f));
}

TEST_CASE("A mesh is written as that PLY to the byte") {
  const TemporaryFolder folder;
  TriangleMesh mesh;
  mesh.positions = {
      {-0.5f, -0.5f, -0.25f}, {0.5f, -0.5f, -0.25f}, {0.5f, 0.5f, -0.25f}, {-0.5f, 0.5f, -0.25f}};
  mesh.faces = {{0, 1, 2}, {0, 2, 3}};
  mesh.world_origin = {10.5, 20.5, -20.0};
  write_ply(folder / "square.ply", mesh);
  CHECK(content(folder / "square.ply") == square(10.0, 20.0));
}

TEST_CASE("A mesh at UTM coordinates comes back the same within a tenth of a millimetre") {
  const TemporaryFolder folder;
  TriangleMesh mesh;
  mesh.world_origin = {148376.0, 6234000.0, 0.0};
  std::uint64_t state = 1;
  const auto random = [&] {  // in [0, 1)
    state = state * 6364136223846793005u + 1442695040888963407u;
    return static_cast<float>(static_cast<double>(state >> 11) / 9007199254740992.0);
  };
  for (int i = 0; i < 5000; ++i)
    mesh.positions.emplace_back(400 * random() - 100, 300 * random() - 200, -40 * random());
  for (std::uint32_t i = 0; i + 2 < 5000; ++i) mesh.faces.push_back({i, i + 1, (i * 7) % 5000});

  write_ply(folder / "a.ply", mesh);
  const TriangleMesh back = read_ply(folder / "a.ply");
  REQUIRE(back.positions.size() == mesh.positions.size());
  CHECK(back.faces == mesh.faces);
  double worst_m = 0.0;
  for (std::size_t i = 0; i < mesh.positions.size(); ++i) {
    const Eigen::Vector3d was = mesh.world_origin + mesh.positions[i].cast<double>();
    const Eigen::Vector3d is = back.world_origin + back.positions[i].cast<double>();
    worst_m = std::max(worst_m, (is - was).cwiseAbs().maxCoeff());
  }
  CHECK(worst_m < 1e-4);
  // Once about its own middle, a mesh is written and read without any change.
  write_ply(folder / "b.ply", back);
  const TriangleMesh again = read_ply(folder / "b.ply");
  CHECK(again.world_origin == back.world_origin);
  CHECK(again.positions == back.positions);
}

TEST_CASE("An empty mesh comes back empty") {
  const TemporaryFolder folder;
  write_ply(folder / "empty.ply", {});
  const TriangleMesh mesh = read_ply(folder / "empty.ply");
  CHECK(mesh.positions.empty());
  CHECK(mesh.faces.empty());
  CHECK(mesh.world_origin == Eigen::Vector3d::Zero());
}

TEST_CASE("A PLY with a wrong header line is refused with its number and the line expected") {
  struct Fault {
    std::string from, to, expected;
  };
  const std::string long_line(5000, 'x');
  const Fault faults[] = {
      {"ply\n", "obj\n", ":1: found \"obj\", expected \"ply\""},
      {"ply\n", "", ":1: found \"format"},
      {"ply\n", "\nply\n", ":1: found \"\""},
      {"ply\n", "\xef\xbb\xbfply\n", ":1: found \"???ply\""},
      {"ply\n", "ply\r\n", ":1: found \"ply?\""},
      {"ply\n", "comment\nply\n", ":1:"},
      {"binary_little_endian", "ascii",
       ":2: found \"format ascii 1.0\", expected \"format binary_lit"},
      {"binary_little_endian", "binary_big_endian", ":2: found \"format binary_big_endian 1.0\""},
      {"1.0\n", "2.0\n", ":2:"},
      {"format binary_little_endian 1.0\n", "", ":2: found \"element"},
      {"format", "format format", ":2:"},
      {"element vertex 4", "element vertex",
       ":3: found \"element vertex\", expected \"element vertex COUNT\""},
      {"element vertex 4", "element vertex ", ":3:"},
      {"element vertex 4", "element vertex -4", ":3:"},
      {"element vertex 4", "element vertex 4.5", ":3:"},
      {"element vertex 4", "element vertex four", ":3:"},
      {"element vertex 4", "element vertex 0x4", ":3:"},
      {"element vertex 4", "element vertex 4 4", ":3:"},
      {"element vertex 4", "element vertex 99999999999999999999999", ":3:"},
      {"element vertex 4", "element vertices 4", ":3:"},
      {"element vertex 4", "element face 4", ":3:"},
      {"double x", "float x", ":4: found \"property float x\", expected \"property double x\""},
      {"double x", "list uchar int x", ":4:"},
      {"double y", "double x", ":5:"},
      {"property double y\n", "", ":5: found \"property double z\""},
      {"property double z\n", "property double z\nproperty uchar red\n",
       ":7: found \"property uchar red\""},
      {"element face 2", "element face", ":7:"},
      {"element face 2", "element edge 2", ":7:"},
      {"uchar int", "int int", ":8:"},
      {"uchar int", "uchar uint", ":8:"},
      {"vertex_indices", "vertex_index", ":8:"},
      {"end_header\n", "", ":9:"},
      {"end_header\n", "end_header", ":9:"},
      {"end_header\n", "element edge 0\nend_header\n", ":9: found \"element edge 0\""},
      {"element vertex 4", long_line, ":3: the header has no end_header within"},
      {"element vertex 4", "comment " + long_line, ":3:"},
      {"element vertex 4", std::string(90, 'y') + "\x1b[31m", ":3: found \"yyy"},
      {"element vertex 4", std::string("a\0b", 3), ":3: found \"a?b\""},
  };
  for (const Fault& fault : faults)
    check_refused(replaced(square(), fault.from, fault.to), fault.expected);
  std::string comments;
  for (int i = 0; i < 1000; ++i) comments += "comment\n";
  check_refused(replaced(square(), "element vertex", comments + "element vertex"), "no end_header");
  check_refused("", ":1:");
  check_refused("ply", ":1:");
  check_refused(std::string(100'000, '\0'), ":1:");
}

TEST_CASE("A PLY whose counts do not fit its size is refused before memory is asked for") {
  const std::string promise = "byte " + std::to_string(header.size());
  for (const char* count : {"5", "4294967296", "4294967300", "1152921504606846976",
                            "18446744073709551615", "768614336404564651"}) {
    const std::string lying = std::string("element vertex ") + count;
    check_refused(replaced(square(), "element vertex 4", lying), "the header promises");
  }
  for (const char* count : {"3", "4294967296", "1418980313362273202", "18446744073709551615"})
    check_refused(replaced(square(), "element face 2", std::string("element face ") + count),
                  "the header promises");
  check_refused(replaced(square(), "element vertex 4", "element vertex 3"), "24 bytes follow");
  check_refused(replaced(square(), "element face 2", "element face 1"), "13 bytes follow");
  check_refused(square() + "x", "1 bytes follow the last face");
  check_refused(square() + square(), "follow the last face");
}

TEST_CASE("A PLY cut off anywhere is refused") {
  const std::string whole = square();
  for (std::size_t size = 0; size < whole.size(); size += size < header.size() ? 13 : 5)
    check_refused(whole.substr(0, size), "");
  check_refused(whole.substr(0, whole.size() - 1), "truncated");
}

TEST_CASE("A PLY with a number that is none, or an index out of range, is refused with its byte") {
  const auto at = [](std::size_t place) {
    return "byte " + std::to_string(header.size() + place) + ": ";
  };
  const double inf = std::numeric_limits<double>::infinity();
  check_refused(patched(0, bytes_of(std::nan(""))), at(0) + "x of vertex 0 is nan");
  check_refused(patched(32, bytes_of(inf)), at(32) + "y of vertex 1 is inf");
  check_refused(patched(88, bytes_of(-inf)), at(88) + "z of vertex 3 is -inf");
  check_refused(patched(24, bytes_of(1e38)), at(24) + "x of vertex 1 is 1e+38");
  check_refused(patched(24, bytes_of(-1.7e308)), at(24));
  check_refused(patched(96, std::string(1, '\4')), at(96) + "face 0 has 4 corners");
  check_refused(patched(96, std::string(1, '\0')), at(96) + "face 0 has 0 corners");
  check_refused(patched(109, std::string(1, '\xff')), at(109) + "face 1 has 255 corners");
  check_refused(patched(97, bytes_of(4)), at(97) + "face 0 names vertex 4, but there are 4");
  check_refused(patched(101, bytes_of(-1)), at(101) + "face 0 names vertex -1");
  check_refused(patched(118, bytes_of(std::numeric_limits<int>::max())), at(118) + "face 1 names");
  check_refused(patched(118, bytes_of(std::numeric_limits<int>::min())), at(118) + "face 1 names");
}

TEST_CASE("A PLY with a byte changed anywhere is refused or gives a finite mesh") {
  const TemporaryFolder folder;
  const std::string whole = square();
  std::uint32_t state = 7;
  int refused = 0;
  for (int i = 0; i < 500; ++i) {
    std::string bytes = whole;
    for (int n = 0; n < 1 + i % 3; ++n) {
      state = state * 1664525u + 1013904223u;
      bytes[(state >> 8) % bytes.size()] = static_cast<char>(state >> 24);
    }
    std::ofstream(folder / "m.ply", std::ios::binary) << bytes;
    try {
      const TriangleMesh mesh = read_ply(folder / "m.ply");
      for (const Eigen::Vector3f& position : mesh.positions) REQUIRE(position.allFinite());
      for (const Face& face : mesh.faces)
        for (const std::uint32_t vertex : face) REQUIRE(vertex < mesh.positions.size());
    } catch (const MeshError&) {
      ++refused;
    }
  }
  CHECK(refused > 250);
}

TEST_CASE("What is no file to read is refused without waiting for it") {
  const TemporaryFolder folder;
  REQUIRE(mkfifo((folder / "pipe").c_str(), 0600) == 0);
  for (const std::filesystem::path& file : {folder / "missing.ply", folder / "pipe", folder.path(),
                                            std::filesystem::path("/dev/zero")}) {
    INFO(file.string());
    CHECK_THROWS_AS(read_ply(file), MeshError);
  }
}
