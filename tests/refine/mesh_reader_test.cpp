#include <ensonify/refine/mesh_reader.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cstdint>
#include <ctime>
#include <fstream>
#include <map>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <sys/stat.h>

#include "support/catch.h"
#include "support/damaged_meshes.h"
#include "support/data.h"
#include "support/files.h"
#include "support/message.h"
#include "support/settings.h"
#include "support/temporary_folder.h"
#include "support/tricky_meshes.h"

using namespace ensonify::refine;
using namespace ensonify::tests;

namespace {

const std::array<const char*, 4> format_names{"ply", "obj", "stl", "off"};

std::string name_of_format(MeshFormat format) {
  return format_names[static_cast<std::size_t>(format)];
}

Eigen::Vector3d world_corner(const TriangleMesh& mesh, std::size_t face, std::size_t k) {
  return mesh.world_origin + mesh.positions.at(mesh.faces.at(face)[k]).cast<double>();
}

/// Bounds of the vertices that faces use, in world metres.
struct WorldBounds {
  Eigen::Vector3d low, high;
  explicit WorldBounds(const TriangleMesh& mesh) : low(world_corner(mesh, 0, 0)), high(low) {
    for (std::size_t face = 0; face < mesh.faces.size(); ++face)
      for (std::size_t k = 0; k < 3; ++k) {
        low = low.cwiseMin(world_corner(mesh, face, k));
        high = high.cwiseMax(world_corner(mesh, face, k));
      }
  }
};

/// Checks everything that mesh_reader.h promises.
void check_sound(const TriangleMesh& mesh) {
  REQUIRE(!mesh.faces.empty());
  REQUIRE(mesh.world_origin.allFinite());
  for (const Eigen::Vector3f& position : mesh.positions) REQUIRE(position.allFinite());
  for (const Face& face : mesh.faces)
    for (const std::uint32_t vertex : face) REQUIRE(vertex < mesh.positions.size());
}

/// Returns whether it was read; the only other result allowed is a MeshError.
bool reads_soundly(const std::string& bytes, MeshFormat format) {
  try {
    check_sound(parse_mesh(bytes, format, "m"));
    return true;
  } catch (const MeshError&) {
    return false;
  }
}

/// A small mesh of each format, with single digits only, so that no number can be shortened.
std::vector<std::pair<MeshFormat, std::string>> small_files() {
  return {{Mesh::ply, text_ply},         {Mesh::ply, binary_ply()},
          {Mesh::ply, binary_ply(true)}, {Mesh::obj, "v 0 0 0\nv 2 0 0\nv 0 3 0\nf 1 2 3\n"},
          {Mesh::stl, text_stl()},       {Mesh::stl, binary_stl()},
          {Mesh::off, text_off}};
}

}  // namespace

TEST_CASE("A damaged mesh is refused with its file, the place and the remedy") {
  const TemporaryFolder folder;
  std::map<MeshFormat, int> count;
  for (const DamagedMesh& damaged : damaged_meshes()) {
    ++count[damaged.format];
    INFO(name_of_format(damaged.format) << ": " << damaged.what);
    const std::filesystem::path file = folder / ("damaged." + name_of_format(damaged.format));
    std::ofstream(file, std::ios::binary) << damaged.bytes;
    std::string message;
    CHECK_NOTHROW([&] {
      try {
        read_mesh(file);
      } catch (const MeshError& error) {
        message = error.what();
      }
    }());
    INFO(message);
    REQUIRE(message.starts_with(file.string() + ":"));
    const std::string place = message.substr(file.string().size());
    CHECK((std::isdigit(static_cast<unsigned char>(place.at(1))) || place.starts_with(": byte ")));
    CHECK(place.find("; ") != std::string::npos);
    CHECK(std::ranges::none_of(message, [](char c) { return c < ' ' || c > '~'; }));
    CHECK(message.size() < 500);
  }
  CHECK(count.size() == 4);
  for (const auto& [format, files] : count) CHECK(files >= 40);
}

TEST_CASE("A valid mesh is read correctly in any spelling") {
  std::map<MeshFormat, int> count;
  for (const TrickyMesh& tricky : tricky_meshes()) {
    ++count[tricky.format];
    INFO(name_of_format(tricky.format) << ": " << tricky.what);
    TriangleMesh mesh;
    REQUIRE_NOTHROW(mesh = parse_mesh(tricky.bytes, tricky.format, "m"));
    check_sound(mesh);
    CHECK(mesh.positions.size() == tricky.vertices);
    REQUIRE(mesh.faces.size() == tricky.faces);
    const WorldBounds box(mesh);
    CHECK((box.low - tricky.low).cwiseAbs().maxCoeff() < 1e-6);
    CHECK((box.high - tricky.high).cwiseAbs().maxCoeff() < 1e-6);
    if (tricky.faces != 4) continue;
    for (std::size_t face = 0; face < 4; ++face)
      for (std::size_t k = 0; k < 3; ++k) {
        const auto corner = static_cast<std::size_t>(tetrahedron_faces[face][k]);
        const auto& [x, y, z] = tetrahedron_corners[corner];
        CHECK((world_corner(mesh, face, k) - Eigen::Vector3d(x, y, z)).norm() < 1e-6);
        if (tricky.format != Mesh::stl) CHECK(mesh.faces[face][k] == corner);
      }
  }
  CHECK(count.size() == 4);
  for (const auto& [format, files] : count) CHECK(files >= 20);
}

TEST_CASE("A message names the line, or the byte, of the fault") {
  const auto message = [](const std::string& bytes, MeshFormat format) {
    return message_thrown<MeshError>([&] { parse_mesh(bytes, format, "dir/m"); }, "read");
  };
  const auto expect = [&](const std::string& bytes, MeshFormat format, const std::string& start) {
    const std::string found = message(bytes, format);
    INFO(found);
    CHECK(found.starts_with("dir/m:" + start));
  };
  const std::string bad_ply = replaced(text_ply, "0 3 0", "0 nan 0");
  for (const auto& [what, bytes] : respelt(bad_ply)) {
    INFO(what);
    expect(bytes, Mesh::ply, "12: a coordinate is \"nan\"");
  }
  expect(replaced(text_ply, "\n3 1 2 3", "\n\n3 1 2 7"), Mesh::ply,
         "17: a face names vertex 7, but there are 4");
  expect(replaced(text_ply, "float y", "flaot y"), Mesh::ply, "5: found \"flaot\"");
  expect(replaced(text_ply, "vertex 4", "vertex 40"), Mesh::ply, "3: the header announces 40");
  const std::size_t body = binary_ply_header().size();
  expect(patched(binary_ply(), body + 16, raw(std::nanf(""))), Mesh::ply,
         fmt::format(" byte {}: a coordinate is nan", body + 16));
  expect(patched(binary_ply(), body + 48 + 18, raw(9)), Mesh::ply,
         fmt::format(" byte {}: a face names vertex 9", body + 66));
  expect(binary_ply() + "x", Mesh::ply,
         fmt::format(" byte {}: 1 bytes follow", binary_ply().size()));
  expect(replaced(text_obj, "f 2 3 4", "f 2 \\\n 3 \\\n5"), Mesh::obj, "9: a face names vertex 5");
  expect(replaced(text_obj, "f 2 3 4", "f 2 \\\n 0 \\\n4"), Mesh::obj, "8: a face names vertex 0");
  expect(replaced(text_obj, "v 0 3 0", "v 0 3"), Mesh::obj, "3: a vertex has 2 numbers");
  expect("v 0 0 0\n", Mesh::obj, "2: the file ends without a face");
  expect(replaced(text_stl(), "vertex 2 0 0", "vertex 2 0"), Mesh::stl, "7: found \"endloop\"");
  expect(patched(binary_stl(), 84 + 12 + 8, raw(1e30f)), Mesh::stl, " byte 104: z of a corner is");
  expect(replaced(text_off, "3 1 2 3", "3 1 2 -3"), Mesh::off, "9: a face names vertex -3");
}

TEST_CASE("A polygon is fanned from its first corner, and faces keep the file's order") {
  const std::vector<Face> expected{{0, 1, 2}, {0, 2, 3}, {4, 3, 2},
                                   {4, 2, 1}, {4, 1, 0}, {1, 2, 4}};
  const std::string vertices = "0 0 0\n1 0 0\n1 1 0\n0 1 0\n0 0 1\n";
  const std::string faces = "4 0 1 2 3\n5 4 3 2 1 0\n3 1 2 4\n";
  const std::string ply =
      replaced(replaced(ply_header, "vertex 4", "vertex 5"), "face 4", "face 3") + vertices + faces;
  CHECK(parse_mesh(ply, Mesh::ply, "m").faces == expected);
  CHECK(parse_mesh("OFF 5 3 0\n" + vertices + faces, Mesh::off, "m").faces == expected);
  const std::string obj = "v " +
                          replaced_each(vertices.substr(0, vertices.size() - 1), "\n", "\nv ") +
                          "\nf 1 2 3 4\nf -1 -2 -3 -4 -5\nf 2/1/1 3//1 5/9\n";
  CHECK(parse_mesh(obj, Mesh::obj, "m").faces == expected);
}

TEST_CASE("A concave polygon is split into triangles that cover it and nothing else") {
  // A fan from the first corner of this L would leave it.
  const std::string corners = "2 0 0\n2 1 0\n1 1 0\n1 2 0\n0 2 0\n0 0 0\n";
  const auto check = [](const TriangleMesh& mesh, double area_m2) {
    double sum_m2 = 0.0;
    for (std::uint32_t face = 0; face < mesh.faces.size(); ++face) {
      const Eigen::Vector3d origin = Triangles(mesh).corner(face, 0);
      const double z_m2 = (Triangles(mesh).corner(face, 1) - origin)
                              .cross(Triangles(mesh).corner(face, 2) - origin)
                              .z();
      CHECK(z_m2 > -1e-4);  // vertices are rounded to float
      sum_m2 += 0.5 * z_m2;
    }
    CHECK(sum_m2 == Approx(area_m2));
  };
  const std::string ply =
      replaced(replaced(ply_header, "vertex 4", "vertex 6"), "face 4", "face 1");
  const TriangleMesh off = parse_mesh("OFF 6 1 0\n" + corners + "6 0 1 2 3 4 5\n", Mesh::off, "m");
  CHECK(off.faces.size() == 4);
  check(off, 3.0);
  CHECK(parse_mesh(ply + corners + "6 0 1 2 3 4 5\n", Mesh::ply, "m").faces == off.faces);
  // Vertices may come after the face that names them.
  const std::string obj =
      "f 1 2 3 4 5 6\nv " + replaced_each(corners.substr(0, corners.size() - 1), "\n", "\nv ");
  CHECK(parse_mesh(obj, Mesh::obj, "m").faces == off.faces);

  // Stars, whose area is known, with corners on straight lines too.
  for (const int points : {2, 3, 5, 40, 200}) {
    CAPTURE(points);
    std::string star = fmt::format("OFF {} 1 0\n", 4 * points), face = std::to_string(4 * points);
    double area_m2 = 0.0;
    Eigen::Vector2d first, before;
    for (int i = 0; i < 4 * points; ++i) {
      const auto corner = [&](int k) -> Eigen::Vector2d {
        const double angle = std::numbers::pi * k / points;
        return (k % 2 == 0 ? 10.0 : 3.0) * Eigen::Vector2d(std::cos(angle), std::sin(angle));
      };
      const Eigen::Vector2d place =
          i % 2 == 0 ? corner(i / 2) : Eigen::Vector2d(0.5 * (corner(i / 2) + corner(i / 2 + 1)));
      if (i == 0) first = place;
      if (i > 0) area_m2 += 0.5 * (before.x() * place.y() - before.y() * place.x());
      before = place;
      star += fmt::format("{} {} 0\n", place.x(), place.y());
      face += fmt::format(" {}", i);
    }
    area_m2 += 0.5 * (before.x() * first.y() - before.y() * first.x());
    const TriangleMesh mesh = parse_mesh(star + face + "\n", Mesh::off, "m");
    CHECK(mesh.faces.size() == static_cast<std::size_t>(4 * points - 2));
    check(mesh, area_m2);
  }
}

TEST_CASE(
    "A concave polygon with very many corners is refused, and one that crosses itself stays") {
  std::string zigzag = "OFF 2004 1 0\n", face = "2004";
  for (int i = 0; i < 2002; ++i) zigzag += fmt::format("{} {} 0\n", i, i % 2);
  zigzag += "2001 9 0\n0 9 0\n";
  for (int i = 0; i < 2004; ++i) face += fmt::format(" {}", i);
  CHECK_THROWS_WITH(parse_mesh(zigzag + face + "\n", Mesh::off, "m"),
                    Catch::Contains("m: a polygon with 2004 corners is concave") &&
                        Catch::Contains("write the file again as triangles"));
  const std::string crossing = "OFF 4 1 0\n0 0 0\n3 3 0\n3 0 0\n0 1 0\n4 0 1 2 3\n";
  CHECK(parse_mesh(crossing, Mesh::off, "m").faces.size() == 2);
}

TEST_CASE("An STL's equal corners are one vertex, in order of appearance") {
  for (const std::string& bytes : {text_stl(), binary_stl()}) {
    const TriangleMesh mesh = parse_mesh(bytes, Mesh::stl, "m");
    CHECK(mesh.faces == std::vector<Face>{{0, 1, 2}, {0, 2, 3}, {2, 1, 3}, {1, 0, 3}});
    CHECK(summarise(mesh).boundary_edges == 0);
  }
  // Adjacent floats are not equal.
  std::string parted = binary_stl();
  parted.replace(84 + 12, 4, raw(std::nextafter(0.0f, 1.0f)));
  CHECK(parse_mesh(parted, Mesh::stl, "m").positions.size() == 5);
}

TEST_CASE("A mesh cut off anywhere is refused, unless only the last line's end is missing") {
  for (const auto& [format, whole] : small_files()) {
    const TriangleMesh mesh = parse_mesh(whole, format, "m");
    const bool binary = whole.find('\0') != std::string::npos;
    for (std::size_t size = 0; size < whole.size(); ++size) {
      INFO(name_of_format(format) << ", binary " << binary << ", the first " << size << " bytes");
      if (!binary && size + 1 == whole.size())
        CHECK(parse_mesh(whole.substr(0, size), format, "m").faces == mesh.faces);
      else
        CHECK_THROWS_AS(parse_mesh(whole.substr(0, size), format, "m"), MeshError);
    }
  }
}

TEST_CASE("A mesh with any change is refused or sound") {
  std::mt19937_64 random(7);
  const auto below = [&](std::size_t n) { return static_cast<std::size_t>(random() % n); };
  const std::vector<std::string> words{"nan", "-1", "1e99", "4294967296", "\n", " ", "#",    "\\\n",
                                       "\r",  "0",  "",     "-",          "/",  "f", "solid"};
  for (const auto& [format, whole] : small_files()) {
    int refused = 0;
    constexpr int tries = 3000;
    for (int i = 0; i < tries; ++i) {
      std::string bytes = whole;
      for (std::size_t n = 1 + below(3); n > 0; --n) {
        const std::size_t place = below(bytes.size());
        switch (below(5)) {
          case 0: bytes[place] = static_cast<char>(below(256)); break;
          case 1: bytes[place] = static_cast<char>(bytes[place] ^ (1 << below(8))); break;
          case 2: bytes.replace(place, below(4), words[below(words.size())]); break;
          case 3: bytes.insert(place, bytes.substr(below(bytes.size()), below(40))); break;
          default:
            bytes.erase(place, 1 + below(20));
            if (bytes.empty()) bytes = whole;
        }
      }
      refused += !reads_soundly(bytes, format);
    }
    INFO(name_of_format(format));
    CHECK(refused > tries / 4);
    CHECK(refused < tries);
  }
}

/// Files of about this many bytes that hold no mesh.
std::vector<std::pair<MeshFormat, std::string>> files_without_content(std::size_t size) {
  const auto many = [&](const std::string& text) {
    std::string all;
    while (all.size() < size) all += text;
    return all;
  };
  std::string properties, elements;
  for (std::size_t i = 0; i < size / 20; ++i) {
    properties += fmt::format("property int p{}\n", i);
    elements += fmt::format("element e{} 0\n", i);
  }
  const std::string end = "element face 4\n";
  return {
      {Mesh::ply, replaced(text_ply, end, properties + end)},
      {Mesh::ply, replaced(text_ply, end, elements + end) + "x"},
      {Mesh::ply, replaced(text_ply, end, "element e 99999999\n" + many("property int p\n") + end)},
      {Mesh::ply, "ply\n" + many("comment\n")},
      {Mesh::ply, "ply\n" + many("c")},
      {Mesh::ply, ply_header + many("\n")},
      {Mesh::obj, many("\\\n")},
      {Mesh::obj, "f" + many("\\ ")},
      {Mesh::obj, "f" + many("\\") + many(" ")},
      {Mesh::obj, many("#")},
      {Mesh::obj, "v 0 0 0\nf" + many(" 1") + " 2\n"},
      {Mesh::obj, many("v 0 0 0\n")},
      {Mesh::stl, many("solid\nendsolid\n")},
      {Mesh::stl, "solid " + many("a")},
      {Mesh::off, "OFF\n" + many("1")},
      {Mesh::off, "OFF\n100 100 0\n" + many("#\n")}};
}

TEST_CASE("A large file without content is refused in a time that grows as its size, not faster") {
  const auto cpu_s = [](MeshFormat format, const std::string& bytes) {
    const std::clock_t start = std::clock();
    CHECK_THROWS_AS(parse_mesh(bytes, format, "m"), MeshError);
    return static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC;
  };
  const auto small = files_without_content(100'000), large = files_without_content(1'600'000);
  for (std::size_t i = 0; i < small.size(); ++i) {
    INFO(name_of_format(large[i].first) << ": " << large[i].second.substr(0, 40));
    // 16 times as large; with the square it would take 256 times as long.
    const double of_small = cpu_s(small[i].first, small[i].second);
    CHECK(cpu_s(large[i].first, large[i].second) < 64.0 * (of_small + 1e-3));
  }
}

TEST_CASE("The same scene at the origin, at UTM and at 1e7 m gives the same local mesh") {
  // The middle is at half a metre, and no coordinate is exact in binary.
  const std::vector<Eigen::Vector3d> scene{
      {0.1, 0.2, -20.3}, {0.9, 0.3, -19.9}, {0.7, 0.8, -20.1}, {0.3, 0.7, -20.7}};
  const auto text = [&](MeshFormat format, const Eigen::Vector3d& shift) {
    std::string vertices, facets = "solid\n";
    const auto line = [&](std::size_t i) {
      const Eigen::Vector3d p = scene[i] + shift;
      return fmt::format("{:.10f} {:.10f} {:.10f}\n", p.x(), p.y(), p.z());
    };
    for (std::size_t i = 0; i < 4; ++i) vertices += (format == Mesh::obj ? "v " : "") + line(i);
    for (const auto& face : tetrahedron_faces) {
      facets += "facet normal 0 0 0 outer loop ";
      for (const int i : face) facets += "vertex " + line(static_cast<std::size_t>(i));
      facets += "endloop endfacet ";
    }
    switch (format) {
      case Mesh::ply: return ply_header + vertices + face_lines;
      case Mesh::obj: return vertices + text_obj.substr(text_obj.find('f'));
      case Mesh::stl: return facets + "endsolid";
      default: return "OFF 4 4 6\n" + vertices + face_lines;
    }
  };
  for (const MeshFormat format : {Mesh::ply, Mesh::obj, Mesh::stl, Mesh::off}) {
    const TriangleMesh here = parse_mesh(text(format, {0, 0, 0}), format, "m");
    for (const Eigen::Vector3d& shift :
         {Eigen::Vector3d(500000, 6234000, 0), {1e7, -1e7, 1e7}, {-3, -10, 20}}) {
      INFO(name_of_format(format) << " at " << shift.transpose());
      const TriangleMesh there = parse_mesh(text(format, shift), format, "m");
      CHECK(there.faces == here.faces);
      CHECK(there.world_origin - here.world_origin == shift);
      REQUIRE(there.positions.size() == here.positions.size());
      for (std::size_t i = 0; i < here.positions.size(); ++i)
        CHECK((there.positions[i] - here.positions[i]).norm() < 1e-6f);
    }
  }
}

TEST_CASE("The world origin is the middle of the vertices that faces use, in whole metres") {
  const std::string far_off =
      replaced(replaced(text_ply, "vertex 4", "vertex 5"), "0 0 5\n", "0 0 5\n1e18 -1e18 7\n");
  const TriangleMesh mesh = parse_mesh(far_off, Mesh::ply, "m");
  CHECK(mesh.world_origin == Eigen::Vector3d(1, 2, 3));
  CHECK(mesh.positions[1] == Eigen::Vector3f(1, -2, -3));
  CHECK(mesh.positions[4].x() == 1e18f);
}

TEST_CASE("A locale with a decimal comma changes nothing") {
  const OtherSettings settings;
  const std::string bytes = replaced(text_off, "2 0 0", "2.5 0 0");
  CHECK(WorldBounds(parse_mesh(bytes, Mesh::off, "m")).high.x() == 2.5);
}

TEST_CASE("A name in an OBJ that ends in a backslash does not swallow the next statement") {
  const auto faces = [](const std::string& statement) {
    return parse_mesh("v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\n" + statement +
                          "f 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n",
                      Mesh::obj, "m")
        .faces.size();
  };
  for (const std::string statement :
       {"usemtl", "mtllib", "g", "o", "usemap", "maplib", "shadow_obj", "trace_obj", "vn 0 0", "s"})
    for (const std::string end : {"\\\n", " \\\n", "\\ \r\n", "\\\r"}) {
      CAPTURE(statement, end);
      CHECK(faces(fmt::format("{} BMCD2AR3\\Solid_Materials_{}", statement, end)) == 4);
      CHECK(faces(fmt::format("{} a{}\t", statement, end)) == 4);
      CHECK(faces(fmt::format("{0} a{1}b c{1}d\n", statement, end)) == 4);  // lines that are joined
    }
  CHECK(faces("# C:\\meshes\\\n") == 4);
}

TEST_CASE("A mesh in UTF-16 or in another format is named as what it is") {
  std::string little = "\xff\xfe", big = "\xfe\xff";
  for (const char c : text_obj) {
    little += {c, '\0'};
    big += {'\0', c};
  }
  for (const MeshFormat format : {Mesh::ply, Mesh::obj, Mesh::stl, Mesh::off})
    for (const std::string& bytes : {little, big})
      CHECK_THROWS_WITH(parse_mesh(bytes, format, "m"),
                        "m: byte 0: the file is in UTF-16, expected UTF-8; save it so");
  for (const std::string name : {"a.dae", "a.GLB", "a.gltf", "a.fbx", "a.step"})
    CHECK_THROWS_WITH(read_mesh(name), Catch::StartsWith(name + ": is a mesh or a solid in a") &&
                                           Catch::Contains("save it as PLY, OBJ, STL or OFF"));
}

TEST_CASE("A file's extension decides its format, in any case") {
  CHECK(mesh_format("a.ply") == Mesh::ply);
  CHECK(mesh_format("dir.ply/a.OBJ") == Mesh::obj);
  CHECK(mesh_format("a.ply.Stl") == Mesh::stl);
  CHECK(mesh_format("a.off") == Mesh::off);
  for (const char* name : {"a", "ply", ".ply", "a.plyx", "a.tif", "a.obj/b", ""})
    CHECK(!mesh_format(name));
  CHECK_THROWS_AS(read_mesh("a.tif"), MeshError);
}

TEST_CASE("A path that is not a regular file is refused without waiting") {
  const TemporaryFolder folder;
  REQUIRE(mkfifo((folder / "pipe.ply").c_str(), 0600) == 0);
  std::filesystem::create_directory(folder / "folder.obj");
  std::filesystem::create_symlink("/dev/zero", folder / "zero.stl");
  std::filesystem::create_symlink("nowhere", folder / "dangling.off");
  for (const char* name : {"missing.ply", "pipe.ply", "folder.obj", "zero.stl", "dangling.off"}) {
    INFO(name);
    CHECK_THROWS_AS(read_mesh(folder / name), MeshError);
  }
}

TEST_CASE("A mesh is written as a binary PLY of doubles, with the expected bytes") {
  const TemporaryFolder folder;
  TriangleMesh mesh;
  mesh.positions = {
      {-0.5f, -0.5f, -0.25f}, {0.5f, -0.5f, -0.25f}, {0.5f, 0.5f, -0.25f}, {-0.5f, 0.5f, -0.25f}};
  mesh.faces = {{0, 1, 2}, {0, 2, 3}};
  mesh.world_origin = {10.5, 20.5, -20.0};
  write_ply(folder / "square.ply", mesh);
  std::string expected =
      replaced(replaced_each(binary_ply_header(), "float", "double"), "face 4", "face 2");
  for (const auto& [x, y] : {std::pair{10.0, 20.0}, {11.0, 20.0}, {11.0, 21.0}, {10.0, 21.0}})
    expected += raw(x) + raw(y) + raw(-20.25);
  for (const Face& face : mesh.faces) {
    expected += '\3';
    for (const std::uint32_t vertex : face) expected += raw(vertex);
  }
  CHECK(read_text(folder / "square.ply") == expected);
}

TEST_CASE("A mesh at UTM coordinates comes back the same within a tenth of a millimetre") {
  const TemporaryFolder folder;
  TriangleMesh mesh;
  mesh.world_origin = {148376.0, 6234000.0, 0.0};
  std::mt19937_64 random(1);
  const auto unit = [&] { return static_cast<float>(random() >> 40) / 16777216.0f; };
  for (int i = 0; i < 5000; ++i)
    mesh.positions.emplace_back(400 * unit() - 100, 300 * unit() - 200, -40 * unit());
  for (std::uint32_t i = 0; i + 2 < 5000; ++i) mesh.faces.push_back({i, i + 1, (i * 7) % 5000});

  write_ply(folder / "a.ply", mesh);
  const TriangleMesh back = read_mesh(folder / "a.ply");
  REQUIRE(back.positions.size() == mesh.positions.size());
  CHECK(back.faces == mesh.faces);
  double worst_m = 0.0;
  for (std::size_t i = 0; i < mesh.positions.size(); ++i) {
    const Eigen::Vector3d was = mesh.world_origin + mesh.positions[i].cast<double>();
    const Eigen::Vector3d is = back.world_origin + back.positions[i].cast<double>();
    worst_m = std::max(worst_m, (is - was).cwiseAbs().maxCoeff());
  }
  CHECK(worst_m < 1e-4);
  // Once its origin is at its middle, a mesh is written and read without any change.
  write_ply(folder / "b.ply", back);
  const TriangleMesh again = read_mesh(folder / "b.ply");
  CHECK(again.world_origin == back.world_origin);
  CHECK(again.positions == back.positions);
}

TEST_CASE("Real meshes have the counts and bounds that other programs found") {
  struct Known {
    const char* file;
    std::array<std::size_t, 4> counts;  ///< vertices, faces, boundary and non-manifold edges
    Eigen::Vector3d low, high;
  };
  // Found with short programs in another language; edges join places, as in summarise().
  const Known meshes[] = {
      {"mesh_underwater/skytteren_wreck.ply",
       {4404, 8358, 320, 34},
       {-98.418411, -12.723749, -10.27315},
       {77.298103, 29.292271, 25.725719}},
      {"mesh_underwater/large_rock.stl",
       {3842, 7680, 0, 0},
       {-1.383181, -0.900177, -0.722283},
       {1.089272, 1.039733, 1.051141}},
      {"mesh_underwater/uxo_b.ply",
       {3208, 3994, 0, 0},
       {-0.94071, -0.230182, -0.24509},
       {0.85012, 0.23412, 0.212917}},
      {"mesh_underwater/coral_mcap.ply",
       {5568, 10939, 195, 0},
       {-1.442744, 0.747069, -3.740072},
       {-1.075112, 1.126385, -3.521532}},
      {"bathymetry/ncei19_nantucket_a.obj",
       {15670, 29917, 1423, 0},
       {484350.0, 57599.300781, -20.648634},
       {485435.0, 58821.898438, 10.431416}},
      {"mesh_standard/spot.obj",
       {2930, 5856, 0, 0},
       {-0.471552, -0.736784, -0.668909},
       {0.471552, 0.953646, 1.049}},
      {"mesh_nasty/manifold_openscad-nonmanifold-crash.obj",
       {717, 1442, 0, 18},
       {-18.0, -10.4, -217.0},
       {-16.0, 7.6, -204.0}},
      {"mesh_nasty/trimesh_negative_indices.obj", {8, 12, 0, 0}, {-1, -1, -1}, {1, 1, 1}},
      {"mesh_nasty/trimesh_polygonfaces.obj", {5, 3, 5, 0}, {-500, 0, -500}, {500, 500, 500}},
      {"mesh_nasty/trimesh_soup.stl",
       {300, 100, 300, 0},
       {0.002359, 0.002531, 0.006098},
       {0.999805, 0.999055, 0.999005}},
  };
  for (const Known& known : meshes) {
    const auto file = data_file(known.file);
    if (!file) {
      WARN("skipped: there is no " << known.file);
      continue;
    }
    INFO(known.file);
    const TriangleMesh mesh = read_mesh(*file);
    check_sound(mesh);
    const MeshSummary summary = summarise(mesh);
    CHECK(std::array{summary.vertices, summary.faces, summary.boundary_edges,
                     summary.non_manifold_edges} == known.counts);
    CHECK((WorldBounds(mesh).low - known.low).cwiseAbs().maxCoeff() < 1e-4);
    CHECK((WorldBounds(mesh).high - known.high).cwiseAbs().maxCoeff() < 1e-4);
  }
}

TEST_CASE("A TIN at coordinates near 4.8e5 keeps every vertex within a tenth of a millimetre") {
  const auto file = data_file("bathymetry/ncei19_nantucket_a.obj");
  if (!file) {
    WARN("skipped: there is no ncei19_nantucket_a.obj");
    return;
  }
  const TriangleMesh mesh = read_mesh(*file);
  std::ifstream lines(*file);
  std::size_t vertex = 0;
  double worst_m = 0.0;
  for (std::string line; std::getline(lines, line);) {
    double x, y, z;
    if (std::sscanf(line.c_str(), "v %lf %lf %lf", &x, &y, &z) != 3) continue;
    const Eigen::Vector3d is = mesh.world_origin + mesh.positions.at(vertex++).cast<double>();
    worst_m = std::max(worst_m, (is - Eigen::Vector3d(x, y, z)).cwiseAbs().maxCoeff());
  }
  CHECK(vertex == mesh.positions.size());
  CHECK(worst_m < 1e-4);
}
