#include <ensonify/engine/trace/embree.h>

#include <algorithm>
#include <cstring>
#include <stdexcept>
#include <string>

#include <embree3/rtcore.h>

namespace ensonify::engine {
namespace {

constexpr std::size_t packet = 16;

std::string pinned_instruction_set() {
#if defined(__x86_64__)
  return __builtin_cpu_supports("avx2") ? "avx2" : "sse4.2";
#else
  return "neon";
#endif
}

void release_device(RTCDevice device) { rtcReleaseDevice(device); }
void release_scene(RTCScene scene) { rtcReleaseScene(scene); }

class Embree final : public Intersector {
 public:
  explicit Embree(refine::Triangles triangles)
      : instruction_set_(pinned_instruction_set()),
        device_(rtcNewDevice(device_options().c_str()), &release_device),
        scene_(nullptr, &release_scene) {
    if (!device_) throw std::runtime_error("Embree has no device here: " + error_of(nullptr));
    scene_.reset(rtcNewScene(device_.get()));
    rtcSetSceneFlags(scene_.get(), RTC_SCENE_FLAG_ROBUST);
    if (!triangles.faces.empty()) attach(triangles);
    rtcCommitScene(scene_.get());
    check();
  }

  std::string_view code_path() const override { return instruction_set_; }

  void intersect(const RayFan& fan, std::span<Hit> hits) const override {
    check_fan(fan, hits);
    RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    context.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
    for (std::size_t plane = 0; plane < fan.planes(); ++plane)
      for (std::size_t first = 0; first < fan.elevations(); first += packet)
        intersect_packet(fan, plane, first, context, hits);
  }

  void intersect(std::span<const Ray> rays, std::span<Hit> hits) const override {
    RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    for (std::size_t i = 0; i < rays.size(); ++i) {
      const Ray& ray = rays[i];
      check_ray(ray);
      RTCRayHit query{};
      const Eigen::Vector3f origin = ray.origin.cast<float>();
      const Eigen::Vector3f direction = ray.direction.cast<float>();
      query.ray.org_x = origin.x(), query.ray.org_y = origin.y(), query.ray.org_z = origin.z();
      query.ray.dir_x = direction.x(), query.ray.dir_y = direction.y();
      query.ray.dir_z = direction.z();
      query.ray.tnear = static_cast<float>(ray.t_min);
      query.ray.tfar = static_cast<float>(ray.t_max);
      query.ray.mask = ~0u;
      query.hit.geomID = RTC_INVALID_GEOMETRY_ID;
      rtcIntersect1(scene_.get(), &context, &query);
      hits[i] = query.hit.geomID == RTC_INVALID_GEOMETRY_ID
                    ? Hit{}
                    : Hit{query.hit.primID, query.ray.tfar, query.hit.u, query.hit.v};
    }
  }

 private:
  std::string device_options() const {
#if defined(__x86_64__)
    return "isa=" + instruction_set_;
#else
    return "";
#endif
  }

  void attach(refine::Triangles triangles) {
    RTCGeometry geometry = rtcNewGeometry(device_.get(), RTC_GEOMETRY_TYPE_TRIANGLE);
    const auto fill = [&](RTCBufferType type, RTCFormat format, const void* from, std::size_t size,
                          std::size_t count) {
      void* to = rtcSetNewGeometryBuffer(geometry, type, 0, format, size, count);
      if (to) std::memcpy(to, from, size * count);
    };
    fill(RTC_BUFFER_TYPE_VERTEX, RTC_FORMAT_FLOAT3, triangles.positions.data(),
         sizeof(Eigen::Vector3f), triangles.positions.size());
    fill(RTC_BUFFER_TYPE_INDEX, RTC_FORMAT_UINT3, triangles.faces.data(), sizeof(refine::Face),
         triangles.faces.size());
    rtcCommitGeometry(geometry);
    rtcAttachGeometry(scene_.get(), geometry);
    rtcReleaseGeometry(geometry);
    check();
  }

  void intersect_packet(const RayFan& fan, std::size_t plane, std::size_t first,
                        RTCIntersectContext& context, std::span<Hit> hits) const {
    const std::size_t count = std::min(packet, fan.elevations() - first);
    alignas(64) int valid[packet] = {};
    alignas(64) RTCRayHit16 query;
    bool any = false;
    const Eigen::Vector3f origin = fan.origin.cast<float>();
    const Eigen::Vector3d broadside = fan.plane_direction(plane);
    for (std::size_t i = 0; i < packet; ++i) {
      // Lanes past the end repeat the last ray, switched off: every lane holds a sound ray.
      const std::size_t elevation = std::min(first + i, fan.elevations() - 1);
      valid[i] = i < count && fan.grid->within_beam(plane, elevation) ? -1 : 0;
      any = any || valid[i];
      const Eigen::Vector3f direction = fan.direction(broadside, elevation).cast<float>();
      query.ray.org_x[i] = origin.x();
      query.ray.org_y[i] = origin.y();
      query.ray.org_z[i] = origin.z();
      query.ray.dir_x[i] = direction.x();
      query.ray.dir_y[i] = direction.y();
      query.ray.dir_z[i] = direction.z();
      query.ray.tnear[i] = 0.0f;
      query.ray.tfar[i] = static_cast<float>(fan.range_m);
      query.ray.time[i] = 0.0f;
      query.ray.mask[i] = ~0u;
      query.ray.id[i] = 0;
      query.ray.flags[i] = 0;
      query.hit.geomID[i] = RTC_INVALID_GEOMETRY_ID;
    }
    if (any) rtcIntersect16(valid, scene_.get(), &context, &query);
    for (std::size_t i = 0; i < count; ++i) {
      Hit& hit = hits[plane * fan.elevations() + first + i];
      hit = !valid[i] || query.hit.geomID[i] == RTC_INVALID_GEOMETRY_ID
                ? Hit{}
                : Hit{query.hit.primID[i], query.ray.tfar[i], query.hit.u[i], query.hit.v[i]};
    }
  }

  void check() const {
    const std::string what = error_of(device_.get());
    if (!what.empty()) throw std::runtime_error("Embree could not build its tree: " + what);
  }

  static std::string error_of(RTCDevice device) {
    switch (rtcGetDeviceError(device)) {
      case RTC_ERROR_NONE: return "";
      case RTC_ERROR_OUT_OF_MEMORY: return "out of memory; take a smaller seafloor or larger cells";
      case RTC_ERROR_UNSUPPORTED_CPU: return "this processor lacks the instruction set";
      case RTC_ERROR_CANCELLED: return "cancelled";
      case RTC_ERROR_INVALID_ARGUMENT: return "invalid argument";
      case RTC_ERROR_INVALID_OPERATION: return "invalid operation";
      default: return "unknown error";
    }
  }

  std::string instruction_set_;
  std::unique_ptr<RTCDeviceTy, void (*)(RTCDevice)> device_;
  std::unique_ptr<RTCSceneTy, void (*)(RTCScene)> scene_;
};

}  // namespace

std::unique_ptr<Intersector> make_embree(refine::Triangles triangles) {
  return std::make_unique<Embree>(triangles);
}

}  // namespace ensonify::engine
