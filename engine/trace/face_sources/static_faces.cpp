#include <ensonify/engine/trace/face_sources/static_faces.h>

namespace ensonify::engine {
namespace {

class StaticFaces final : public FaceSource {
 public:
  explicit StaticFaces(const FaceSourceParts& parts) : all_(parts.all), whole_(parts.whole) {}
  const Intersector& prepare(std::span<const RayFan>) override { return *whole_; }
  refine::Triangles triangles() const override { return all_; }
  std::uint64_t version() const override { return 0; }

 private:
  refine::Triangles all_;
  std::shared_ptr<const Intersector> whole_;
};

}  // namespace

std::unique_ptr<FaceSource> make_static_faces(const FaceSourceParts& parts) {
  return std::make_unique<StaticFaces>(parts);
}

}  // namespace ensonify::engine
