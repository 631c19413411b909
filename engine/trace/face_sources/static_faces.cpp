#include <ensonify/engine/trace/face_sources/static_faces.h>

namespace ensonify::engine {
namespace {

class StaticFaces final : public FaceSource {
 public:
  explicit StaticFaces(const FaceSourceParts& parts) : all_(parts.all), whole_(parts.whole) {}
  Faces prepare(std::span<const RayFan>) override { return {whole_.get(), all_}; }

 private:
  refine::Triangles all_;
  std::shared_ptr<const Intersector> whole_;
};

}  // namespace

std::unique_ptr<FaceSource> make_static_faces(const FaceSourceParts& parts) {
  return std::make_unique<StaticFaces>(parts);
}

}  // namespace ensonify::engine
