#pragma once

#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include <ensonify/refine/mesh_reader.h>
#include <ensonify/refine/mesh_repair.h>

#include "support/files.h"
#include "support/manifold.h"
#include "support/temporary_folder.h"

// Shared by the fuzz targets. A target ignores the documented exceptions; everything else (another
// exception, a sanitizer's report, a broken promise) is a finding.
namespace ensonify::tests {

/// Aborts the program if `kept` is false, so that the fuzzer keeps the input.
inline void promise(bool kept, std::string_view what) {
  if (kept) return;
  std::fprintf(stderr, "broken promise: %.*s\n", static_cast<int>(what.size()), what.data());
  std::abort();
}

inline std::string_view text(const std::uint8_t* data, std::size_t size) {
  return {reinterpret_cast<const char*>(data), size};
}

/// The texts between the zero bytes of an input; empty ones follow, up to `count`.
inline std::vector<std::string> texts(const std::uint8_t* data, std::size_t size,
                                      std::size_t count) {
  std::vector<std::string> all(1);
  for (std::size_t i = 0; i < size; ++i)
    if (data[i] == 0)
      all.emplace_back();
    else
      all.back() += static_cast<char>(data[i]);
  if (all.size() < count) all.resize(count);
  return all;
}

/// Writes an input to a file, whose folder is removed at the end.
inline std::filesystem::path file_of(const std::uint8_t* data, std::size_t size,
                                     const std::string& name) {
  static const TemporaryFolder folder;
  write_text(folder / name, std::string(text(data, size)));
  return folder / name;
}

inline void check_mesh(const refine::TriangleMesh& mesh) {
  promise(!mesh.faces.empty(), "there is a face");
  promise(mesh.world_origin.allFinite(), "the world origin is finite");
  for (const Eigen::Vector3f& position : mesh.positions)
    promise(position.allFinite(), "positions are finite");
  for (const refine::Face& face : mesh.faces)
    for (const std::uint32_t vertex : face)
      promise(vertex < mesh.positions.size(), "faces use existing vertices");
}

inline void check_repair(const refine::TriangleMesh& mesh, double weld_tolerance_m) {
  const refine::RepairedMesh repaired = refine::repair(mesh, weld_tolerance_m);
  const std::string fault = manifold_fault(repaired.mesh);
  promise(fault.empty(), fault);
  const refine::RepairReport& report = repaired.report;
  promise(repaired.mesh.faces.size() + report.degenerate_faces + report.duplicate_faces ==
              mesh.faces.size(),
          "dropped faces are counted");
  const refine::RepairedMesh again = refine::repair(repaired.mesh, weld_tolerance_m);
  promise(again.report.total() == 0 && again.mesh.faces == repaired.mesh.faces &&
              again.mesh.positions == repaired.mesh.positions,
          "a repaired mesh needs no repair");
}

/// Runs one input of a mesh reader's target.
inline int fuzz_mesh(const std::uint8_t* data, std::size_t size, refine::MeshFormat format) {
  refine::TriangleMesh mesh;
  try {
    mesh = refine::parse_mesh(text(data, size), format, "fuzz");
  } catch (const refine::MeshError&) {
    return 0;
  }
  check_mesh(mesh);
  if (mesh.faces.size() <= 1000)
    for (const double weld_tolerance_m : {0.0, 0.5, -1.0}) check_repair(mesh, weld_tolerance_m);
  return 0;
}

}  // namespace ensonify::tests
