#include <array>
#include <cstring>
#include <string>
#include <vector>

#include <sys/mman.h>
#include <unistd.h>

#include <ensonify/refine/active_mesh.h>
#include <ensonify/refine/footprint.h>
#include <ensonify/refine/progressive_mesh_file.h>
#include <ensonify/refine/tile_collapse.h>

#include "fuzz/fuzz.h"
#include "support/meshes.h"
#include "support/progressive_file.h"

using namespace ensonify;
using tests::ProgressiveFile;

namespace {

/// One change of a file: the section (after the last one: the header), the offset and the new
/// value.
struct Edit {
  std::uint8_t section, kind;
  std::uint16_t place;
  std::uint32_t value;
};

/// A file in memory that has a name.
class MemoryFile {
 public:
  MemoryFile() : number_(memfd_create("fuzz", 0)) {}
  std::string name() const { return "/proc/self/fd/" + std::to_string(number_); }
  void hold(const std::string& bytes) const {
    const auto size = static_cast<ssize_t>(bytes.size());
    tests::promise(
        ftruncate(number_, size) == 0 && pwrite(number_, bytes.data(), bytes.size(), 0) == size,
        "the input fits into memory");
  }

 private:
  int number_;
};

std::vector<ProgressiveFile> make_files() {
  std::vector<ProgressiveFile> files;
  refine::TriangleMesh several = tests::open_grid(4, 4, 6.0, 0.5, 3);
  tests::join(several, tests::ball(1, 3.0), {-8.0f, 5.0f, 4.0f});
  for (const refine::TriangleMesh& source :
       {tests::open_grid(7, 6, 6.0, 0.5, 1), tests::torus(7, 5, 15.0, 5.0), several}) {
    const std::string file = "/tmp/ensonify-fuzz-" + std::to_string(getpid());
    refine::save(refine::build_by_tiles(source, 1), {}, file);
    std::FILE* const stream = std::fopen(file.c_str(), "rb");
    std::string bytes(1 << 20, '\0');
    bytes.resize(std::fread(bytes.data(), 1, bytes.size(), stream));
    std::fclose(stream);
    unlink(file.c_str());
    files.push_back({bytes});
  }
  return files;
}

void apply(const Edit& edit, ProgressiveFile& file) {
  const std::size_t section = edit.section % 9;
  const bool header = edit.section >= 0xc0;
  const std::size_t begin = header ? ProgressiveFile::leaves : file.offset_of(section);
  const std::size_t places =
      (header ? ProgressiveFile::header_bytes - begin : file.bytes_of(section)) / 4;
  if (places == 0) return;
  const std::size_t at = begin + edit.place % places * 4;
  const std::size_t other = begin + edit.value % places * 4;
  const auto old = file.get<std::uint32_t>(at);
  switch (edit.kind % 4) {
    case 0: return file.put(at, edit.value);
    case 1: return file.put(at, edit.value & 0xff);
    case 2: return file.put(at, old + (edit.value & 0xff) - 0x80);
    default: file.put(at, file.get<std::uint32_t>(other)); return file.put(other, old);
  }
}

}  // namespace

// The first byte selects a valid file; the others change it and correct its checksums.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const std::vector<ProgressiveFile> files = make_files();
  static const MemoryFile memory;
  if (size == 0) return 0;
  ProgressiveFile file = files[data[0] % files.size()];
  for (std::size_t at = 1; at + sizeof(Edit) <= size; at += sizeof(Edit)) {
    Edit edit;
    std::memcpy(&edit, data + at, sizeof edit);
    apply(edit, file);
  }
  file.correct_checksums();
  memory.hold(file.bytes);

  tests::Random random(data[0]);
  const auto attempt = [](const auto& work) {
    try {
      work();
      return true;
    } catch (const refine::MeshError&) {
      return false;
    }
  };
  attempt([&] {
    const refine::ProgressiveMesh mesh = refine::map_progressive_mesh(memory.name());
    const auto check = [&](const refine::ExactFaces& exact) {
      for (const refine::Face& face : exact.faces)
        for (const std::uint32_t leaf : face)
          tests::promise(exact.points[leaf].allFinite(), "exact faces have finite corners");
    };
    refine::Footprint footprint(mesh);
    for (int i = 0; i < 2; ++i) {
      const refine::FanVolume volume = tests::random_volume(random, 40.0);
      attempt([&] { check(footprint.query({&volume, 1})); });
    }
    refine::ActiveMesh active(mesh);
    for (int i = 0; i < 4; ++i) {
      const refine::FanVolume volume = tests::random_volume(random, 40.0);
      const auto refine_there = [&] {
        active.refine({&volume, 1});
        check(active.exact_faces());
      };
      if (!attempt(refine_there)) active.reset();
    }
  });
  return 0;
}
