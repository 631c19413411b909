#include <ensonify/engine/seafloor/seafloor.h>

#include <fmt/format.h>

#include <ensonify/refine/mesh_reader.h>

namespace ensonify::engine {

refine::Bounds Seafloor::bounds() const {
  return progressive ? progressive->bounds : refine::bounds(mesh);
}

std::uint16_t Seafloor::tag_of(std::uint32_t face) const {
  if (progressive->tag_count() == 0) return 0;
  const std::uint16_t tag = progressive->tag(face);
  if (tag < labels.size()) return tag;
  throw refine::MeshError(fmt::format(
      "the progressive mesh gives face {} the label {}, but has only {} labels; analyse it again",
      face, tag, labels.size()));
}

}  // namespace ensonify::engine
