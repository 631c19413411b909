#include "bare_embree.h"

#include <algorithm>
#include <array>
#include <stdexcept>
#include <string>

#include <ensonify/engine/trace/embree/embree.h>
#include <ensonify/engine/trace/embree/embree_api-inl.h>

namespace ensonify::bench {
namespace {

using engine::Hit;
using engine::Ray;
using engine::RayFan;

class BareEmbree final : public engine::Intersector {
 public:
  explicit BareEmbree(const engine::IntersectorOptions& options)
      : set_(engine::make_embree(options)->code_path()),
        device_(rtcNewDevice(("isa=" + set_).c_str())),
        scene_(rtcNewScene(device_)) {
    rtcSetSceneFlags(scene_, RTC_SCENE_FLAG_ROBUST);
  }
  ~BareEmbree() override {
    rtcReleaseScene(scene_);
    rtcReleaseDevice(device_);
  }
  BareEmbree(const BareEmbree&) = delete;

  void build(refine::Triangles triangles) override {
    RTCGeometry geometry = rtcNewGeometry(device_, RTC_GEOMETRY_TYPE_TRIANGLE);
    rtcSetSharedGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3,
                               triangles.positions.data(), 0, sizeof(Eigen::Vector3f),
                               triangles.positions.size());
    rtcSetSharedGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
                               triangles.faces.data(), 0, sizeof(refine::Face),
                               triangles.faces.size());
    rtcCommitGeometry(geometry);
    rtcAttachGeometry(scene_, geometry);
    rtcReleaseGeometry(geometry);
    rtcCommitScene(scene_);
  }

  std::string_view code_path() const override { return set_; }

  void intersect(const RayFan& fan, std::span<Hit>) const override {
    if (rtcGetDeviceProperty(device_, RTC_DEVICE_PROPERTY_NATIVE_RAY16_SUPPORTED))
      trace<16>(fan);
    else if (rtcGetDeviceProperty(device_, RTC_DEVICE_PROPERTY_NATIVE_RAY8_SUPPORTED))
      trace<8>(fan);
    else
      trace<4>(fan);
  }
  void intersect(std::span<const Ray>, std::span<Hit>) const override {
    throw std::invalid_argument("the bare loop traces fans only");
  }

 private:
  template <int lanes>
  void trace(const RayFan& fan) const {
    engine::EmbreeQuery query(true);
    alignas(64) std::array<int, lanes> valid;
    alignas(64) engine::EmbreePacket<lanes> packet{};
    const Eigen::Vector3f origin = fan.origin.cast<float>();
    std::fill_n(packet.ray.org_x, lanes, origin.x());
    std::fill_n(packet.ray.org_y, lanes, origin.y());
    std::fill_n(packet.ray.org_z, lanes, origin.z());
    std::fill_n(packet.ray.mask, lanes, ~0u);
    for (std::size_t plane = 0; plane < fan.planes(); ++plane) {
      const Eigen::Vector3d broadside = fan.plane_direction(plane);
      for (std::size_t first = 0; first < fan.elevations(); first += lanes) {
        const std::size_t count = std::min<std::size_t>(lanes, fan.elevations() - first);
        bool any = false;
        for (std::size_t i = 0; i < lanes; ++i) {
          valid[i] = i < count && fan.grid->within_beam(plane, first + i) ? -1 : 0;
          any |= valid[i] != 0;
        }
        if (!any) continue;
        for (std::size_t i = 0; i < lanes; ++i) {
          const std::size_t elevation = first + std::min(i, count - 1);
          const Eigen::Vector3f direction = fan.direction(broadside, elevation).cast<float>();
          packet.ray.dir_x[i] = direction.x();
          packet.ray.dir_y[i] = direction.y();
          packet.ray.dir_z[i] = direction.z();
          packet.ray.tfar[i] = static_cast<float>(fan.range_m);
          packet.hit.geomID[i] = RTC_INVALID_GEOMETRY_ID;
        }
        query.run(scene_, valid.data(), packet);
      }
    }
  }

  std::string set_;
  RTCDevice device_;
  RTCScene scene_;
};

}  // namespace

std::unique_ptr<engine::Intersector> make_bare_embree(const engine::IntersectorOptions& options) {
  return std::make_unique<BareEmbree>(options);
}

}  // namespace ensonify::bench
