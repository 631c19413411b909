// The two tables of kinds: intersectors and face sources. One more row is all that a new back-end
// needs to be listed, tested and timed.

#include <array>
#include <stdexcept>
#include <vector>

#include <fmt/format.h>

#include <ensonify/engine/base/made_once.h>
#include <ensonify/engine/trace/embree/embree.h>
#include <ensonify/engine/trace/exact/pluecker.h>
#include <ensonify/engine/trace/face_source.h>
#include <ensonify/engine/trace/face_sources/exact_faces.h>
#include <ensonify/engine/trace/face_sources/static_faces.h>
#include <ensonify/engine/trace/fan_scan/fan_scan.h>
#include <ensonify/engine/trace/intersector.h>
#include <ensonify/refine/tile_collapse.h>
#include <ensonify/scatter/kind_named.h>

namespace ensonify::engine {
namespace {

constexpr std::array intersectors{
    IntersectorKind{.name = "embree",
                    .help = "Embree's bounding volume hierarchy, packets of rays, float",
                    .make = &make_embree,
                    .bytes_per_face = 70.0,
                    .builds_tree = true},
    IntersectorKind{.name = "embree-single",
                    .help = "the same, ray by ray: shows the gain of packets",
                    .make = &make_embree_single,
                    .bytes_per_face = 70.0,
                    .builds_tree = true},
    IntersectorKind{.name = "fan_scan",
                    .help = "scan conversion of a fan, no tree; fans only, for few faces",
                    .make = &make_fan_scan,
                    .takes_lists = false,
                    .precision = Precision::in_double,
                    .bytes_per_face = 30.0},
    IntersectorKind{.name = reference_intersector,
                    .help = "the reference: Plücker's test, double, ties decided exactly",
                    .make = &make_pluecker,
                    .precision = Precision::exact,
                    .bytes_per_face = 160.0},
    IntersectorKind{.name = "brute_force",
                    .help = "the same test for every face and every ray: slow",
                    .make = &make_brute_force,
                    .precision = Precision::exact,
                    .tests_every_face = true},
};

constexpr std::array surfaces{
    FaceSourceKind{static_surface, "all faces, built once", false, false, &make_static_faces},
    FaceSourceKind{refined_surface, "the exact faces of a mesh that is refined for each ping", true,
                   false, &make_refined_faces},
    FaceSourceKind{footprint_surface, "the same faces, found by a query for each ping", true, true,
                   &make_footprint_faces},
};

std::vector<IntersectorKind> with_those_of_the_program() {
  std::vector<IntersectorKind> all(intersectors.begin(), intersectors.end());
  for (const IntersectorKind& kind : program_intersector_kinds()) {
    if (kind.name.empty() || !kind.make)
      throw std::invalid_argument(
          fmt::format("program_intersector_kinds: the intersector '{}' has no {}; give it one",
                      kind.name, kind.name.empty() ? "name" : "function `make`"));
    for (const IntersectorKind& other : all)
      if (scatter::same_name(kind.name, other.name))
        throw std::invalid_argument(
            fmt::format("program_intersector_kinds: the name '{}' is taken by the intersector "
                        "'{}'; choose another",
                        kind.name, other.name));
    all.push_back(kind);
  }
  return all;
}

}  // namespace

// Weak, so that a definition in the program replaces it.
[[gnu::weak]] std::span<const IntersectorKind> program_intersector_kinds() { return {}; }

std::span<const IntersectorKind> intersector_kinds() {
  return made_once<with_those_of_the_program>();
}

const IntersectorKind& intersector_kind(std::string_view name) {
  return scatter::kind_named(intersector_kinds(), "intersector", name);
}

std::unique_ptr<Intersector> make_intersector(std::string_view name, refine::Triangles triangles,
                                              const IntersectorOptions& options) {
  std::unique_ptr<Intersector> made = intersector_kind(name).make(options);
  made->build(triangles);
  return made;
}

std::span<const FaceSourceKind> face_source_kinds() { return surfaces; }

std::vector<std::string_view> face_source_names() {
  std::vector<std::string_view> names;
  for (const FaceSourceKind& kind : surfaces) names.push_back(kind.name);
  return names;
}

const FaceSourceKind& face_source_kind(std::string_view name) {
  return scatter::kind_named(surfaces, "surface", name);
}

double build_bytes_per_face(const FaceSourceKind& surface, const IntersectorKind& intersector) {
  return surface.needs_progressive_mesh ? refine::tile_collapse_bytes_per_face
                                        : intersector.bytes_per_face;
}

}  // namespace ensonify::engine
