#include <ensonify/refine/progressive_mesh_file.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <csignal>
#include <cstdint>
#include <fstream>
#include <set>
#include <string>
#include <system_error>
#include <thread>
#include <utility>
#include <vector>

#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <ensonify/refine/active_mesh.h>
#include <ensonify/refine/footprint.h>
#include <ensonify/refine/tile_collapse.h>

#include "support/catch.h"
#include "support/files.h"
#include "support/invariants.h"
#include "support/meshes.h"
#include "support/message.h"
#include "support/progressive_file.h"
#include "support/temporary_folder.h"

namespace fs = std::filesystem;
using namespace ensonify::refine;
using ensonify::tests::broken_invariants;
using ensonify::tests::names_in;
using ensonify::tests::ProgressiveFile;
using ensonify::tests::Random;
using ensonify::tests::random_volume;
using ensonify::tests::read_text;
using ensonify::tests::same_bytes;
using ensonify::tests::TemporaryFolder;
using ensonify::tests::write_text;

namespace {

struct Exact {
  std::vector<Face> faces;
  std::vector<std::uint32_t> sources;
  bool operator==(const Exact&) const = default;

  Exact(const ExactFaces& exact)
      : faces(exact.faces.begin(), exact.faces.end()),
        sources(exact.source_faces.begin(), exact.source_faces.end()) {}
};

std::vector<std::uint16_t> tags_for(const TriangleMesh& mesh) {
  std::vector<std::uint16_t> tags;
  for (std::size_t f = 0; f < mesh.faces.size(); ++f)
    tags.push_back(static_cast<std::uint16_t>(40503 * f));
  return tags;
}

const TriangleMesh& grid() {
  static const TriangleMesh mesh = [] {
    TriangleMesh out = ensonify::tests::open_grid(6, 6, 1.0, 0.5, 5);
    out.world_origin = {5e5, 6.2e6, -12.25};
    return out;
  }();
  return mesh;
}
/// A mesh with several groups.
const TriangleMesh& large_grid() {
  static const TriangleMesh mesh = ensonify::tests::open_grid(110, 110, 0.3, 0.2, 6);
  return mesh;
}

void save_with_extras(const TriangleMesh& mesh, const fs::path& file, std::string_view key = "k") {
  const std::vector<std::uint16_t> tags = tags_for(mesh);
  save(ProgressiveMesh(build_by_tiles(mesh, 1)), {tags, "about\0it", key}, file);
}

void flip(const fs::path& file, std::size_t bit) {
  std::fstream stream(file, std::ios::binary | std::ios::in | std::ios::out);
  stream.seekg(static_cast<std::streamoff>(bit / 8));
  const auto byte = static_cast<char>(stream.get() ^ (1 << bit % 8));
  stream.seekp(static_cast<std::streamoff>(bit / 8));
  stream.put(byte);
}

/// The error message for a file that is mapped and read completely; empty if it is valid.
std::string complaint(const fs::path& file) {
  return ensonify::tests::message_thrown<MeshError>(
      [&] { map_progressive_mesh(file).verify_all(); });
}

/// Runs work in another process and returns its exit status.
template <class Work>
int in_child(const Work& work) {
  const pid_t child = fork();
  if (child == 0) {
    int result = 99;
    try {
      result = work();
    } catch (...) {
    }
    _exit(result);
  }
  int status = -1;
  REQUIRE(waitpid(child, &status, 0) == child);
  return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
}

}  // namespace

TEST_CASE(
    "a progressive mesh comes back from its file to the bit, with all that was saved with it") {
  const TemporaryFolder folder;
  for (auto [name, source] : ensonify::tests::manifold_meshes()) {
    INFO(name);
    source.world_origin = {500000.25, 6.2e6, -30.0};
    const ProgressiveMesh mesh = build_by_tiles(source, 2);
    CHECK(mesh.world_origin == source.world_origin);
    const std::vector<std::uint16_t> tags = tags_for(source);
    const std::string about(4097, 'a'), key(64, 'k');  // a byte more than a page
    save(mesh, {tags, about, key}, folder / "f");
    const ProgressiveMesh back = map_progressive_mesh(folder / "f");
    back.verify_all();
    CHECK(same_bytes(mesh, back));
    CHECK(back.bounds.lowest == bounds(source).lowest);
    CHECK(back.bounds.highest == bounds(source).highest);
    CHECK(back.about() == about);
    CHECK(back.key() == key);
    REQUIRE(back.tag_count() == tags.size());
    for (std::uint32_t f = 0; f < tags.size(); ++f) REQUIRE(back.tag(f) == tags[f]);

    // A mapped mesh can be saved, and without extras none are saved.
    save(back, {}, folder / "again");
    const ProgressiveMesh again = map_progressive_mesh(folder / "again");
    again.verify_all();
    CHECK(same_bytes(mesh, again));
    CHECK(again.about().empty());
    CHECK(again.key().empty());
    CHECK(again.tag_count() == 0);
  }
  save(ProgressiveMesh(), {}, folder / "nothing");
  CHECK(map_progressive_mesh(folder / "nothing").leaves() == 0);
}

TEST_CASE("a file has 68 bytes per vertex and some pages, and the same mesh gives the same bytes") {
  const TemporaryFolder folder;
  const ProgressiveMesh mesh = build_by_tiles(large_grid(), 2);
  save(mesh, {}, folder / "a");
  save(mesh, {}, folder / "b");
  CHECK(read_text(folder / "a") == read_text(folder / "b"));
  CHECK(fs::file_size(folder / "a") < 68 * mesh.points.size() + 12 * 4096);
}

TEST_CASE("a mapped mesh gives the same exact faces as the one in memory") {
  const TemporaryFolder folder;
  for (const auto& [name, source] : ensonify::tests::manifold_meshes()) {
    INFO(name);
    const ProgressiveMesh mesh = build_by_tiles(source, 2);
    save(mesh, {}, folder / "f");
    const ProgressiveMesh mapped = map_progressive_mesh(folder / "f");
    Footprint walk(mesh), mapped_walk(mapped);
    ActiveMesh active(mesh), mapped_active(mapped);
    Random random(3);
    int different = 0;
    for (int i = 0; i < 100; ++i) {
      const FanVolume volume = random_volume(random, 40.0);
      different += Exact(walk.query({&volume, 1})) != Exact(mapped_walk.query({&volume, 1}));
      active.refine({&volume, 1});
      mapped_active.refine({&volume, 1});
      different += Exact(active.exact_faces()) != Exact(mapped_active.exact_faces());
    }
    CHECK(different == 0);
    CHECK(broken_invariants(mapped_active).empty());
  }
}

TEST_CASE("every truncation of a file is refused, and so are bytes after its end") {
  const TemporaryFolder folder;
  save_with_extras(grid(), folder / "f");
  const std::size_t size = fs::file_size(folder / "f");
  write_text(folder / "longer", read_text(folder / "f") + '\0');
  CHECK(complaint(folder / "longer").find("bytes, but its header requires") != std::string::npos);
  std::size_t accepted = 0;
  for (std::size_t bytes = size; bytes-- > 0;) {
    REQUIRE(truncate((folder / "f").c_str(), static_cast<off_t>(bytes)) == 0);
    accepted += complaint(folder / "f").empty();
  }
  CHECK(accepted == 0);
}

TEST_CASE("any changed bit is noticed, padding included") {
  const TemporaryFolder folder;
  save_with_extras(grid(), folder / "f");
  REQUIRE(complaint(folder / "f").empty());
  const std::size_t bits = 8 * fs::file_size(folder / "f");
  Random random(11);
  int missed = 0;
  for (std::size_t i = 0; i < 1000 + 8 * ProgressiveFile::header_bytes; ++i) {
    const std::size_t bit = i < 1000 ? random() % bits : i - 1000;
    flip(folder / "f", bit);
    const std::string said = complaint(folder / "f");
    missed += said.find((folder / "f").string() + ": ") != 0;
    flip(folder / "f", bit);
  }
  CHECK(missed == 0);
  CHECK(complaint(folder / "f").empty());
}

TEST_CASE("a changed byte is noticed before it is used, and the active mesh works after a reset") {
  const TemporaryFolder folder;
  const fs::path file = folder / "f";
  const ProgressiveMesh mesh = build_by_tiles(large_grid(), 2);
  REQUIRE(mesh.mid.size() > 2 * ProgressiveMesh::group);
  save(mesh, {}, file);
  const std::size_t bits = 8 * fs::file_size(file);
  Random random(12);
  int noticed = 0, untouched = 0, wrong = 0;
  for (int i = 0; i < 150; ++i) {
    FanVolume volume = random_volume(random, 20.0);
    volume.range_m = 6.0;
    Footprint walk(mesh);
    ActiveMesh active(mesh);
    const Exact expected = walk.query({&volume, 1});
    active.refine({&volume, 1});
    const Exact refined = active.exact_faces();
    const std::size_t bit = random() % bits;
    flip(file, bit);
    try {
      const ProgressiveMesh mapped = map_progressive_mesh(file);
      Footprint damaged_walk(mapped);
      try {
        wrong += Exact(damaged_walk.query({&volume, 1})) != expected;
        ++untouched;
      } catch (const DamagedFile& error) {
        ++noticed;
        wrong += std::string(error.what()).find(file.string() + ": bytes ") != 0;
      }
      try {
        ActiveMesh damaged(mapped);
        try {
          damaged.refine({&volume, 1});
        } catch (const DamagedFile&) {
          damaged.reset();
        }
        flip(file, bit);
        damaged.refine({&volume, 1});
        wrong += Exact(damaged.exact_faces()) != refined;
      } catch (const DamagedFile&) {  // thrown by its constructor
        flip(file, bit);
      }
      wrong += Exact(damaged_walk.query({&volume, 1})) != expected;
    } catch (const DamagedFile&) {  // or before it
      flip(file, bit);
    }
  }
  CHECK(wrong == 0);
  CHECK(noticed > 20);
  CHECK(untouched > 5);
}

TEST_CASE("a file that is not a progressive mesh is refused with the reason") {
  const TemporaryFolder folder;
  const fs::path file = folder / "f";
  const auto says = [&](const std::string& what) {
    const std::string said = complaint(file);
    INFO(said);
    CHECK(said.find(file.string() + ": " + what) == 0);
  };
  says("there is no such file");
  write_text(file, "");
  says("not a progressive mesh file");
  write_text(file, "ply\nformat ascii 1.0\n");
  says("not a progressive mesh file");
  fs::remove(file);
  REQUIRE(mkfifo(file.c_str(), 0600) == 0);
  says("is not a regular file");
  fs::remove(file);
  fs::create_directory(file);
  says("is a folder");
  fs::remove(file);
  fs::create_symlink("/dev/zero", file);
  says("is not a regular file");
  fs::remove(file);

  save_with_extras(grid(), file);
  ProgressiveFile other{read_text(file)};
  other.put(ProgressiveFile::version, std::uint32_t{2});
  other.correct_checksums();
  write_text(file, other.bytes);
  says("has version 2 of the format, but only 1 can be read");
  other.put(ProgressiveFile::byte_order, std::uint32_t{0x04030201});
  write_text(file, other.bytes);
  says("from a machine of the other byte order");
}

TEST_CASE("invalid headers and tables are refused, even with right checksums or huge sizes") {
  using File = ProgressiveFile;
  const TemporaryFolder folder;
  const fs::path file = folder / "f";
  save_with_extras(grid(), file);
  const File good{read_text(file)};
  {
    File same = good;
    same.correct_checksums();
    REQUIRE(same.bytes == good.bytes);  // the checksums are the program's
  }
  rusage before{};
  getrusage(RUSAGE_SELF, &before);
  int cases = 0;
  const auto refused = [&](const std::string& what, const auto& change) {
    File bad = good;
    change(bad);
    bad.correct_checksums();
    write_text(file, bad.bytes);
    const std::string said = complaint(file);
    INFO(what);
    CHECK(said.find(file.string() + ": ") == 0);
    CHECK(said.find("again") != std::string::npos);
    ++cases;
  };
  for (const std::uint64_t value :
       {std::uint64_t{0}, std::uint64_t{1}, std::uint64_t{1} << 20, std::uint64_t{1} << 31,
        std::uint64_t{1} << 32, ~std::uint64_t{0}})
    for (const std::size_t field : {File::leaves, File::roots, File::base_faces, File::source_faces,
                                    File::tags, File::about_bytes}) {
      if (good.get<std::uint64_t>(field) == value) continue;
      refused("a count", [&](File& f) { f.put(field, value); });
    }
  for (std::size_t s = 0; s < 10; ++s) {
    const std::size_t at = File::sections + 16 * s;
    refused("an offset", [&](File& f) { f.put(at, good.get<std::uint64_t>(at) + 4096); });
    refused("an overlap", [&](File& f) { f.put(at, std::uint64_t{4096} - 4096 * (s == 0)); });
    refused("a huge offset", [&](File& f) { f.put(at, ~std::uint64_t{4095}); });
    refused("a size", [&](File& f) { f.put(at + 8, good.get<std::uint64_t>(at + 8) + 4); });
    refused("a huge size", [&](File& f) { f.put(at + 8, ~std::uint64_t{0}); });
  }
  const double nan = std::numeric_limits<double>::quiet_NaN();
  refused("an origin", [&](File& f) { f.put(File::world_origin + 8, nan); });
  refused("bounds", [&](File& f) { f.put(File::lowest, static_cast<float>(nan)); });
  refused("bounds", [&](File& f) { f.put(File::lowest, 1e9f); });
  refused("bounds", [&](File& f) { f.put(File::highest, 1e30f); });
  refused("a root", [&](File& f) { f.put(f.offset_of(File::root), std::uint32_t{1}); });
  refused("a root", [&](File& f) {
    f.put(f.offset_of(File::root) + f.bytes_of(File::root) - 4, std::uint32_t{1} << 30);
  });
  const auto last = [](File& f, File::Section s) { return f.offset_of(s) + f.bytes_of(s) - 4; };
  refused("a base face", [&](File& f) { f.put(last(f, File::faces), std::uint32_t{1000}); });
  refused("a base face", [&](File& f) { f.put(last(f, File::source_face), std::uint32_t{1000}); });
  refused("an inner face", [&](File& f) { f.put(f.offset_of(File::faces), std::uint32_t{1000}); });
  refused("half a face",
          [&](File& f) { f.put(f.offset_of(File::faces) + 4, ProgressiveMesh::none); });
  refused("a source face",
          [&](File& f) { f.put(f.offset_of(File::source_face), std::uint32_t{1} << 20); });
  refused("a point", [&](File& f) { f.put(f.offset_of(File::points) + 8, 1e30f); });
  refused("a point", [&](File& f) { f.put(f.offset_of(File::points), static_cast<float>(nan)); });
  refused("a sphere", [&](File& f) { f.put(f.offset_of(File::spheres) + 12, -1.0f); });
  refused("a sphere", [&](File& f) { f.put(f.offset_of(File::spheres), static_cast<float>(nan)); });
  CHECK(cases >= 90);
  rusage after{};
  getrusage(RUSAGE_SELF, &after);
  CHECK(after.ru_maxrss - before.ru_maxrss < 64 * 1024);
}

TEST_CASE("contradictory hierarchies with right checksums are refused without a crash") {
  using File = ProgressiveFile;
  const TemporaryFolder folder;
  const fs::path file = folder / "f";
  save(build_by_tiles(ensonify::tests::open_grid(9, 9, 1.0, 0.5, 5), 1), {}, file);
  const File good{read_text(file)};
  Random random(21);
  int refused = 0, fine = 0;
  for (int i = 0; i < 1000; ++i) {
    File bad = good;
    for (std::uint64_t n = 0; n < 1 + random() % 3; ++n) {
      const std::array<File::Section, 6> changed = {File::mid,         File::order, File::faces,
                                                    File::source_face, File::root,  File::spheres};
      const File::Section s = changed[random() % changed.size()];
      const auto any = [&] { return bad.offset_of(s) + random() % (bad.bytes_of(s) / 4) * 4; };
      if (s == File::spheres) {
        bad.put(any(), static_cast<float>(random() % 100));
      } else if (random() % 2 == 0) {
        bad.put(any(), static_cast<std::uint32_t>(random() % 130));
      } else {
        const std::size_t a = any(), b = any();
        const auto value = bad.get<std::uint32_t>(a);
        bad.put(a, bad.get<std::uint32_t>(b));
        bad.put(b, value);
      }
    }
    bad.correct_checksums();
    write_text(file, bad.bytes);
    bool is_fine = true;
    try {
      const ProgressiveMesh mesh = map_progressive_mesh(file);
      const auto attempt = [&](const auto& work) {
        try {
          work();
        } catch (const DamagedFile&) {
          is_fine = false;
        }
      };
      Random view(22);
      Footprint walk(mesh);
      for (int k = 0; k < 4; ++k) {
        const FanVolume volume = random_volume(view, 12.0);
        attempt([&] { walk.query({&volume, 1}); });
      }
      ActiveMesh active(mesh);
      for (int k = 0; k < 12; ++k) {
        const FanVolume volume = random_volume(view, 12.0);
        attempt([&] {
          if (!is_fine) active.reset();
          active.refine({&volume, 1});
        });
      }
    } catch (const DamagedFile&) {
      is_fine = false;
    }
    ++(is_fine ? fine : refused);
  }
  INFO(refused << " refused, " << fine << " not");
  CHECK(refused > 200);
  CHECK(fine > 20);
}

TEST_CASE("a base face with two corners in one tree is refused") {
  using File = ProgressiveFile;
  const TemporaryFolder folder;
  const fs::path file = folder / "f";
  save(build_by_tiles(ensonify::tests::open_grid(9, 9, 1.0, 0.5, 5), 1), {}, file);
  const File good{read_text(file)};
  const std::size_t first_base_face = 2 * good.bytes_of(File::mid) / sizeof(std::uint32_t);
  const std::size_t at = good.offset_of(File::faces) + first_base_face * sizeof(Face);
  for (std::size_t corner = 0; corner < 3; ++corner) {
    INFO(corner);
    File bad = good;
    bad.put(at + 4 * corner, good.get<std::uint32_t>(at + 4 * ((corner + 1) % 3)));
    bad.correct_checksums();
    write_text(file, bad.bytes);
    const ProgressiveMesh mesh = map_progressive_mesh(file);
    CHECK_THROWS_WITH(ActiveMesh(mesh), Catch::Contains("a base face has two corners in one tree"));
  }
}

TEST_CASE("threads that first use a mapped mesh at the same time get its content") {
  const TemporaryFolder folder;
  const TriangleMesh& source = large_grid();
  const ProgressiveMesh mesh = build_by_tiles(source, 2);
  const std::vector<std::uint16_t> tags = tags_for(source);
  save(mesh, {tags}, folder / "f");
  std::vector<FanVolume> volumes;
  std::vector<Exact> expected;
  Random random(4);
  Footprint walk(mesh);
  for (int i = 0; i < 8; ++i) {
    volumes.push_back(random_volume(random, 30.0));
    expected.emplace_back(walk.query({&volumes.back(), 1}));
  }
  std::atomic<int> wrong = 0;
  for (int round = 0; round < 10; ++round) {
    const ProgressiveMesh mapped = map_progressive_mesh(folder / "f");
    std::vector<std::jthread> threads;
    for (std::size_t t = 0; t < 4; ++t)
      threads.emplace_back([&, t] {
        Footprint own(mapped);
        ActiveMesh active(mapped);
        for (std::size_t i = 0; i < volumes.size(); ++i) {
          const std::size_t v = (i + 2 * t) % volumes.size();
          wrong += Exact(own.query({&volumes[v], 1})) != expected[v];
          active.refine({&volumes[v], 1});
          for (const std::uint32_t face : active.exact_faces().source_faces)
            wrong += mapped.tag(face) != tags[face];
        }
      });
  }
  CHECK(wrong == 0);
}

TEST_CASE("a killed writer leaves a complete file, old or new") {
  const TemporaryFolder folder;
  const fs::path file = folder / "f";
  const ProgressiveMesh a = build_by_tiles(large_grid(), 1), b = build_by_tiles(grid(), 1);
  save(a, {.key = "a"}, file);
  Random random(31);
  int torn = 0;
  for (int i = 0; i < 60; ++i) {
    const pid_t child = fork();
    REQUIRE(child >= 0);
    if (child == 0)
      for (;;) {
        save(b, {.key = "b"}, file);
        save(a, {.key = "a"}, file);
      }
    std::this_thread::sleep_for(std::chrono::microseconds(random() % 20'000));
    kill(child, SIGKILL);
    int status = 0;
    REQUIRE(waitpid(child, &status, 0) == child);
    const ProgressiveMesh found = map_progressive_mesh(file);
    found.verify_all();
    torn += !(found.key() == "a" ? same_bytes(found, a) : same_bytes(found, b));
  }
  CHECK(torn == 0);
  for (const std::string& name : names_in(folder.path()))
    CHECK((name == "f" || (name.starts_with(".f.") && name.ends_with(".tmp"))));
}

TEST_CASE("two processes that save one file both succeed, and readers see complete files") {
  const TemporaryFolder folder;
  const fs::path file = folder / "f";
  const ProgressiveMesh a = build_by_tiles(large_grid(), 1), b = build_by_tiles(grid(), 1);
  save(a, {.key = "a"}, file);
  std::vector<pid_t> children;
  for (const ProgressiveMesh* mesh : {&a, &b}) {
    children.push_back(fork());
    if (children.back() != 0) continue;
    int result = 0;
    try {
      for (int i = 0; i < 40; ++i) save(*mesh, {.key = mesh == &a ? "a" : "b"}, file);
    } catch (...) {
      result = 1;
    }
    _exit(result);
  }
  int torn = 0;
  for (int i = 0; i < 100; ++i) {
    const ProgressiveMesh found = map_progressive_mesh(file);
    found.verify_all();
    torn += !(found.key() == "a" ? same_bytes(found, a) : same_bytes(found, b));
  }
  for (const pid_t child : children) {
    int status = -1;
    REQUIRE(waitpid(child, &status, 0) == child);
    CHECK(WIFEXITED(status));
    CHECK(WEXITSTATUS(status) == 0);
  }
  CHECK(torn == 0);
  CHECK(names_in(folder.path()) == std::set<std::string>{"f"});
}

TEST_CASE("a failed save names the place and reason, and leaves nothing") {
  const TemporaryFolder folder;
  const ProgressiveMesh mesh = build_by_tiles(grid(), 1);
  const auto fails_naming = [&](const fs::path& file) {
    try {
      save(mesh, {}, file);
      return 1;
    } catch (const std::system_error& error) {
      return std::string(error.what()).find(file.string() + ": cannot ") == 0 ? 0 : 2;
    }
  };
  CHECK(in_child([&] {
          std::signal(SIGXFSZ, SIG_IGN);
          const rlimit limit{20'000, 20'000};
          setrlimit(RLIMIT_FSIZE, &limit);
          return fails_naming(folder / "f");
        }) == 0);
  fs::create_directory(folder / "read-only");
  fs::permissions(folder.path(), fs::perms(0755));
  fs::permissions(folder / "read-only", fs::perms(0555));
  CHECK(in_child([&] {
          if (geteuid() == 0 && seteuid(65534) != 0) return 3;
          return fails_naming(folder / "read-only" / "f");
        }) == 0);
  CHECK(names_in(folder / "read-only").empty());
  CHECK(names_in(folder.path()) == std::set<std::string>{"read-only"});
}

TEST_CASE("what a file cannot hold is not saved") {
  const TemporaryFolder folder;
  const ProgressiveMeshArrays good = build_by_tiles(grid(), 1);
  const auto refused = [&](const auto& change) {
    ProgressiveMeshArrays bad = good;
    change(bad);
    CHECK_THROWS_AS(save(std::move(bad), {}, folder / "f"), std::invalid_argument);
  };
  refused([](auto& m) { m.points.emplace_back(0.0f, 0.0f, 0.0f); });
  refused([](auto& m) { m.order.pop_back(); });
  refused([](auto& m) { m.spheres.pop_back(); });
  refused([](auto& m) { m.source_face.pop_back(); });
  refused([](auto& m) { m.spheres[0].radius = std::numeric_limits<float>::infinity(); });
  refused([](auto& m) { m.points[0][1] = std::numeric_limits<float>::quiet_NaN(); });
  refused([](auto& m) { m.roots[0] = 1; });
  refused([](auto& m) { m.source_face.back() = ProgressiveMesh::none; });
  const std::vector<std::uint16_t> few(3);
  CHECK_THROWS_AS(save(good, {.tags = few}, folder / "f"), std::invalid_argument);
  CHECK_THROWS_AS(save(good, {.key = std::string(65, 'k')}, folder / "f"), std::invalid_argument);
  CHECK_THROWS_AS(save(good, {.key = std::string_view("a\0b", 3)}, folder / "f"),
                  std::invalid_argument);
  CHECK(names_in(folder.path()).empty());
}
