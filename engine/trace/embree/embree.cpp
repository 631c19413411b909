#include <ensonify/engine/trace/embree/embree.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>
#include <stdexcept>
#include <string>

#if defined(__x86_64__)
#include <cpuid.h>
#endif

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <tbb/task_arena.h>

#include <ensonify/engine/trace/embree/embree_api-inl.h>

namespace ensonify::engine {
namespace {

constexpr float inf = std::numeric_limits<float>::infinity();
constexpr float largest_float = std::numeric_limits<float>::max();

// Up to this size no product of three lengths in Embree's tests overflows, even with ray origins at
// 1e18 m.
constexpr double largest_vertex_m = 1e9;

constexpr double slack = 2e-7;  // a few units in a float's last place

/// A query that keeps the nearest hit; at equal distance the face with the lowest number, whatever
/// the order in which the tree offers them.
///
/// Two faces that share an edge may both be hit there, at distances that differ by rounding. Embree
/// skips the second face's box if the first hit is nearer than the box, so the tree decides which
/// of the two it offers. Therefore a hit shortens the ray to slightly more than the hit's distance:
/// both faces are offered, and the nearest is the same for every tree over the same faces.
struct NearestHit : EmbreeQuery {
  static constexpr int max_lanes = 16;
  static constexpr float beyond_hit = 1.0f + 0x1p-16f;
  const std::uint32_t* numbers;  // of faces; null: their indices
  alignas(64) std::array<float, max_lanes> t;
  alignas(64) std::array<std::uint32_t, max_lanes> face;

  NearestHit(bool coherent, std::span<const std::uint32_t> face_numbers)
      : EmbreeQuery(coherent), numbers(face_numbers.empty() ? nullptr : face_numbers.data()) {}
  void start() {
    t.fill(inf);
    face.fill(Hit::none);
  }

  /// The filter for a device of that instruction set. It is called about ten thousand times per
  /// ping, so a separate version is worthwhile.
  static RTCFilterFunctionN filter_for(std::string_view instruction_set) {
#if defined(__x86_64__)
    if (instruction_set.starts_with("avx2") || instruction_set.starts_with("avx512"))
      return &filter_avx2;
#endif
    return &filter;
  }

 private:
  bool comes_first(unsigned one, unsigned other) const {
    if (!numbers || numbers[one] == numbers[other]) return one < other;
    return numbers[one] < numbers[other];
  }

  // Explicit vector types: the compiler does not vectorise loops over arrays that may overlap.
  template <class Number, unsigned lanes>
  struct Register {
    using Numbers __attribute__((vector_size(lanes * sizeof(Number)))) = Number;
  };

  // Embree drops each hit whose `valid` is 0 afterwards.
  template <unsigned lanes>
  [[gnu::always_inline]] static void filter_lanes(const RTCFilterFunctionNArguments* args) {
    using Floats = typename Register<float, lanes>::Numbers;
    using Masks = typename Register<int, lanes>::Numbers;
    auto& best = *static_cast<NearestHit*>(args->context);
    float* ends = &RTCRayN_tfar(args->ray, lanes, 0);
    const unsigned* faces = &RTCHitN_primID(args->hit, lanes, 0);
    Floats t, best_t;
    Masks valid, face, best_face;
    std::memcpy(&t, ends, sizeof t);
    std::memcpy(&valid, args->valid, sizeof valid);
    std::memcpy(&face, faces, sizeof face);
    std::memcpy(&best_face, best.face.data(), sizeof best_face);
    std::memcpy(&best_t, best.t.data(), sizeof best_t);
    const Masks ties = valid & (t == best_t);
    int any_tie = 0;
    for (unsigned i = 0; i < lanes; ++i) any_tie |= ties[i];
    if (any_tie) [[unlikely]] {
      best.settle_ties(args->valid, ends, faces, lanes);
      std::memcpy(&best_t, best.t.data(), sizeof best_t);
    }
    const Masks keep = valid & (t < best_t);
    const Floats end = t * beyond_hit;
    const Masks new_end = (keep & (Masks)end) | (~keep & (Masks)t);
    const Masks new_t = (keep & (Masks)t) | (~keep & (Masks)best_t);
    const Masks new_face = (keep & face) | (~keep & best_face);
    std::memcpy(args->valid, &keep, sizeof keep);
    std::memcpy(best.t.data(), &new_t, sizeof new_t);
    std::memcpy(best.face.data(), &new_face, sizeof new_face);
    std::memcpy(ends, &new_end, sizeof new_end);
  }
  /// Clears hits at the same distance whose face comes later, so that the new face wins.
  [[gnu::noinline]] void settle_ties(const int* valid, const float* other_t, const unsigned* faces,
                                     unsigned lanes) {
    for (unsigned i = 0; i < lanes; ++i)
      if (valid[i] != 0 && other_t[i] == t[i] && comes_first(faces[i], face[i])) t[i] = inf;
  }
  [[gnu::always_inline]] static void filter_any(const RTCFilterFunctionNArguments* args) {
    switch (args->N) {
      case 16: return filter_lanes<16>(args);
      case 8: return filter_lanes<8>(args);
      case 4: return filter_lanes<4>(args);
      default: return filter_lanes<1>(args);
    }
  }
  static void filter(const RTCFilterFunctionNArguments* args) { filter_any(args); }
#if defined(__x86_64__)
  [[gnu::target("avx2")]] static void filter_avx2(const RTCFilterFunctionNArguments* args) {
    filter_any(args);
  }
#endif
};

/// Copies the vertices for a tree of one ping. Embree's Morton codes give each axis the same number
/// of steps across the box of the faces, so over a level bed they would sort by height before
/// place, and rays would take three times as long. Two faces without area stretch the box to a
/// cube. The corners are copied because the vertices may be the whole seafloor's, to which nothing
/// can be added.
class Gathered {
 public:
  refine::Triangles operator()(refine::Triangles triangles) {
    const std::size_t faces = triangles.faces.size() + 2;
    positions_.resize(3 * faces + 1);  // one extra: see readable_beyond
    for (auto n = static_cast<std::uint32_t>(faces_.size()); n < faces; ++n)
      faces_.push_back({3 * n, 3 * n + 1, 3 * n + 2});

    Eigen::Vector3f* to = positions_.data();
    Eigen::Vector3f low = Eigen::Vector3f::Constant(inf), high = -low;
    for (const refine::Face& face : triangles.faces)
      for (const std::uint32_t corner : face) {
        *to = triangles.positions[corner];
        low = low.cwiseMin(*to);
        high = high.cwiseMax(*to);
        ++to;
      }
    const Eigen::Vector3f middle = 0.5f * (low + high);
    const Eigen::Vector3f half = Eigen::Vector3f::Constant(0.5f * (high - low).maxCoeff());
    std::fill(to, to + 3, middle - half);
    std::fill(to + 3, to + 6, middle + half);
    return {std::span(positions_).first(3 * faces), std::span(faces_).first(faces)};
  }

 private:
  std::vector<Eigen::Vector3f> positions_;
  std::vector<refine::Face> faces_;
};

class Embree final : public Intersector {
 public:
  Embree(const IntersectorOptions& options, bool packets)
      : options_(options), scene_(nullptr, &rtcReleaseScene), device_(nullptr, &rtcReleaseDevice) {
    pin_instruction_set();
#if defined(__x86_64__)
    device_.reset(rtcNewDevice(("isa=" + options_.instruction_set).c_str()));
#else
    device_.reset(rtcNewDevice(""));
#endif
    if (!device_) throw std::runtime_error("Embree could not make a device on this machine");
    rtcSetDeviceErrorFunction(device_.get(), &Embree::remember, this);
    code_path_ = options_.instruction_set + (options_.robust ? "" : " fast");
    const auto native = [&](RTCDeviceProperty rays) {
      return rtcGetDeviceProperty(device_.get(), rays) != 0;
    };
    if (packets)
      lanes_ = native(RTC_DEVICE_PROPERTY_NATIVE_RAY16_SUPPORTED)  ? 16
               : native(RTC_DEVICE_PROPERTY_NATIVE_RAY8_SUPPORTED) ? 8
                                                                   : 4;
  }

  void build(refine::Triangles triangles) override {
    scene_.reset();  // first, so that two trees never need memory at once
    triangles_ = triangles;
    check_vertices(triangles, largest_vertex_m);
    if (triangles.faces.empty()) return;
    try {
      if (options_.for_one_ping)
        build_tree(gathered_(triangles));
      else
        build_tree({readable_beyond(triangles.positions), triangles.faces});
    } catch (...) {
      scene_.reset();
      throw;
    }
  }

  std::string_view code_path() const override { return code_path_; }

  void intersect(const RayFan& fan, std::span<Hit> hits) const override {
    check_fan(fan, hits);
    if (!scene_)
      std::ranges::fill(hits, Hit{});
    else if (lanes_ == 16)
      trace_packets<16>(fan, hits);
    else if (lanes_ == 8)
      trace_packets<8>(fan, hits);
    else if (lanes_ == 4)
      trace_packets<4>(fan, hits);
    else
      trace_one_by_one(fan, hits);
  }

  void intersect(std::span<const Ray> rays, std::span<Hit> hits) const override {
    if (rays.size() != hits.size())
      throw std::invalid_argument("`hits` must have one element for every ray");
    NearestHit query(false, triangles_.numbers);
    for (std::size_t i = 0; i < rays.size(); ++i) {
      check_ray(rays[i]);
      hits[i] = scene_ ? trace_scaled(rays[i], query) : Hit{};
    }
  }

 private:
  void pin_instruction_set() {
    const std::vector<std::string_view> there = instruction_sets();
    std::string& name = options_.instruction_set;
    const auto has = [&](std::string_view set) { return std::ranges::count(there, set) > 0; };
    if (name.empty()) name = has("avx2") ? "avx2" : has("sse4.2") ? "sse4.2" : there.front();
    if (!has(name))
      throw std::invalid_argument(fmt::format(
          "this machine has no instruction set '{}'; it has: {}", name, fmt::join(there, ", ")));
  }

  /// Embree loads 16 bytes at each vertex of 12. It ignores the 4 bytes beyond the last vertex, but
  /// they must be readable. They are, unless the last vertex ends at the end of a memory page.
  std::span<const Eigen::Vector3f> readable_beyond(std::span<const Eigen::Vector3f> positions) {
    constexpr std::uintptr_t page = 4096;  // no machine has smaller pages
    padded_ = {};
    if (reinterpret_cast<std::uintptr_t>(positions.data() + positions.size()) % page != 0)
      return positions;
    padded_.reserve(positions.size() + 1);
    padded_.assign(positions.begin(), positions.end());
    return padded_;
  }

  void build_tree(refine::Triangles triangles) {
    const RTCBuildQuality quality =
        options_.for_one_ping ? RTC_BUILD_QUALITY_LOW : RTC_BUILD_QUALITY_MEDIUM;
    scene_.reset(rtcNewScene(device_.get()));
    check();
    int flags = options_.robust ? RTC_SCENE_FLAG_ROBUST : RTC_SCENE_FLAG_NONE;
    if (options_.for_one_ping) flags |= RTC_SCENE_FLAG_DYNAMIC;
    rtcSetSceneFlags(scene_.get(), static_cast<RTCSceneFlags>(flags));
    rtcSetSceneBuildQuality(scene_.get(), quality);

    const std::unique_ptr<RTCGeometryTy, void (*)(RTCGeometry)> geometry(
        rtcNewGeometry(device_.get(), RTC_GEOMETRY_TYPE_TRIANGLE), &rtcReleaseGeometry);
    check();
    rtcSetGeometryBuildQuality(geometry.get(), quality);
    rtcSetGeometryIntersectFilterFunction(geometry.get(),
                                          NearestHit::filter_for(options_.instruction_set));
    rtcSetSharedGeometryBuffer(geometry.get(), RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3,
                               triangles.positions.data(), 0, sizeof(Eigen::Vector3f),
                               triangles.positions.size());
    rtcSetSharedGeometryBuffer(geometry.get(), RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
                               triangles.faces.data(), 0, sizeof(refine::Face),
                               triangles.faces.size());
    rtcCommitGeometry(geometry.get());
    rtcAttachGeometry(scene_.get(), geometry.get());
    if (options_.for_one_ping)
      // The device option threads=1 would limit all of TBB to one thread.
      this_thread_.execute([&] { rtcCommitScene(scene_.get()); });
    else
      rtcCommitScene(scene_.get());
    check();
  }

  Hit to_hit(unsigned face, float t, float u, float v) const {
    // + 0.0 because Embree may report hits at -0.
    return {triangles_.number(face), face, static_cast<double>(t) + 0.0, u, v};
  }

  template <int lanes>
  void trace_packets(const RayFan& fan, std::span<Hit> hits) const {
    NearestHit query(true, triangles_.numbers);
    alignas(64) std::array<int, lanes> valid;
    alignas(64) EmbreePacket<lanes> packet;
    RTCRayHit all = ray_from(fan.origin, 0.0f, range_of(fan));
    for (int i = 0; i < lanes; ++i) {
      packet.ray.org_x[i] = all.ray.org_x;
      packet.ray.org_y[i] = all.ray.org_y;
      packet.ray.org_z[i] = all.ray.org_z;
      packet.ray.tnear[i] = all.ray.tnear;
      packet.ray.time[i] = all.ray.time;
      packet.ray.mask[i] = all.ray.mask;
      packet.ray.id[i] = all.ray.id;
      packet.ray.flags[i] = all.ray.flags;
    }
    for (std::size_t plane = 0; plane < fan.planes(); ++plane) {
      const Eigen::Vector3d broadside = fan.plane_direction(plane);
      for (std::size_t first = 0; first < fan.elevations(); first += lanes) {
        const std::size_t count = std::min<std::size_t>(lanes, fan.elevations() - first);
        Hit* to = &hits[plane * fan.elevations() + first];
        bool any = false;
        for (std::size_t i = 0; i < lanes; ++i) {
          valid[i] = i < count && fan.grid->within_beam(plane, first + i) ? -1 : 0;
          any |= valid[i] != 0;
        }
        if (!any) {
          std::fill_n(to, count, Hit{});
          continue;
        }
        for (std::size_t i = 0; i < lanes; ++i) {
          // Lanes past the end are off and repeat the last ray, so that every lane holds a valid
          // ray.
          const std::size_t elevation = first + std::min(i, count - 1);
          const Eigen::Vector3f direction = rounded(fan.direction(broadside, elevation));
          packet.ray.dir_x[i] = direction.x();
          packet.ray.dir_y[i] = direction.y();
          packet.ray.dir_z[i] = direction.z();
          packet.ray.tfar[i] = all.ray.tfar;
          packet.hit.geomID[i] = RTC_INVALID_GEOMETRY_ID;
        }
        query.start();
        query.run(scene_.get(), valid.data(), packet);
        for (std::size_t i = 0; i < count; ++i)
          to[i] = packet.hit.geomID[i] == RTC_INVALID_GEOMETRY_ID
                      ? Hit{}
                      : to_hit(packet.hit.primID[i], query.t[i], packet.hit.u[i], packet.hit.v[i]);
      }
    }
  }

  void trace_one_by_one(const RayFan& fan, std::span<Hit> hits) const {
    NearestHit query(true, triangles_.numbers);
    RTCRayHit ray = ray_from(fan.origin, 0.0f, range_of(fan));
    for (std::size_t plane = 0; plane < fan.planes(); ++plane) {
      const Eigen::Vector3d broadside = fan.plane_direction(plane);
      for (std::size_t elevation = 0; elevation < fan.elevations(); ++elevation) {
        RTCRayHit one = ray;
        set_direction(one, fan.direction(broadside, elevation));
        hits[plane * fan.elevations() + elevation] =
            fan.grid->within_beam(plane, elevation) ? trace_one(one, query) : Hit{};
      }
    }
  }

  /// A double direction may be zero or infinite as float. It is scaled by a power of two to a
  /// length near 1, which changes no other bit.
  Hit trace_scaled(const Ray& ray, NearestHit& query) const {
    int exponent;
    std::frexp(ray.direction.cwiseAbs().maxCoeff(), &exponent);
    const auto scaled = [&](double x) {
      return static_cast<float>(std::min<double>(std::ldexp(x, exponent), largest_float));
    };
    // Slightly longer, so that a hit at an end is not lost to rounding.
    RTCRayHit one =
        ray_from(ray.origin, scaled(ray.t_min * (1.0 - slack)), scaled(ray.t_max * (1.0 + slack)));
    set_direction(one, ray.direction.unaryExpr([&](double x) { return std::ldexp(x, -exponent); }));
    Hit hit = trace_one(one, query);
    if (!hit) return hit;
    hit.t = std::clamp(std::ldexp(hit.t, -exponent), ray.t_min, ray.t_max);
    return std::isfinite(hit.t) ? hit : Hit{};  // the distance overflows double
  }

  Hit trace_one(RTCRayHit& ray, NearestHit& query) const {
    query.t[0] = inf;
    query.face[0] = Hit::none;
    query.run(scene_.get(), ray);
    return ray.hit.geomID == RTC_INVALID_GEOMETRY_ID
               ? Hit{}
               : to_hit(ray.hit.primID, query.t[0], ray.hit.u, ray.hit.v);
  }

  static RTCRayHit ray_from(const Eigen::Vector3d& origin, float t_near, float t_far) {
    RTCRayHit one{};
    const Eigen::Vector3f from = origin.cast<float>();
    one.ray.org_x = from.x(), one.ray.org_y = from.y(), one.ray.org_z = from.z();
    one.ray.tnear = t_near, one.ray.tfar = t_far;
    one.ray.mask = ~0u;
    one.hit.geomID = RTC_INVALID_GEOMETRY_ID;
    return one;
  }
  /// Embree replaces a component up to 1e-18 by 1e-18, whatever its sign, but still uses the sign:
  /// packets with such a ray miss. It handles 0 correctly.
  static Eigen::Vector3f rounded(const Eigen::Vector3d& direction) {
    constexpr float taken_for_itself = 2e-18f;
    const Eigen::Array3f to = direction.array().cast<float>();
    return (to.abs() < taken_for_itself).select(0.0f, to);
  }
  static void set_direction(RTCRayHit& one, const Eigen::Vector3d& direction) {
    const Eigen::Vector3f to = rounded(direction);
    one.ray.dir_x = to.x(), one.ray.dir_y = to.y(), one.ray.dir_z = to.z();
  }
  /// Not more than the fan's range, and finite, so that a distance that overflows is no hit.
  static float range_of(const RayFan& fan) {
    const auto range = static_cast<float>(std::min<double>(fan.range_m, largest_float));
    return range > fan.range_m ? std::nextafter(range, 0.0f) : range;
  }

  /// Embree's error callback: memory may be short, so it only stores the first error.
  static void remember(void* self, RTCError code, const char* text) {
    auto& error = static_cast<Embree*>(self)->error_;
    if (error.code != RTC_ERROR_NONE) return;
    error.code = code;
    const std::string_view what = text ? text : "";
    error.text[what.copy(error.text.data(), error.text.size() - 1)] = '\0';
  }
  void check() {
    if (error_.code == RTC_ERROR_NONE) return;
    const bool memory = error_.code == RTC_ERROR_OUT_OF_MEMORY;
    error_.code = RTC_ERROR_NONE;
    throw std::runtime_error(fmt::format(
        "Embree could not build its tree: {}",
        memory ? "out of memory; use a smaller seafloor or larger cells" : error_.text.data()));
  }

  IntersectorOptions options_;
  refine::Triangles triangles_;
  std::string code_path_;
  int lanes_ = 1;
  struct {
    RTCError code = RTC_ERROR_NONE;
    std::array<char, 160> text{};
  } error_;
  Gathered gathered_;                                      // used if for_one_ping
  tbb::task_arena this_thread_{1};                         // used if for_one_ping
  std::vector<Eigen::Vector3f> padded_;                    // used otherwise
  std::unique_ptr<RTCSceneTy, void (*)(RTCScene)> scene_;  // null if there are no faces
  std::unique_ptr<RTCDeviceTy, void (*)(RTCDevice)> device_;
};

}  // namespace

std::unique_ptr<Intersector> make_embree(const IntersectorOptions& options) {
  return std::make_unique<Embree>(options, true);
}

std::unique_ptr<Intersector> make_embree_single(const IntersectorOptions& options) {
  return std::make_unique<Embree>(options, false);
}

std::vector<std::string_view> instruction_sets() {
#if defined(__x86_64__)
  // Each set with the features that Embree requires for it.
  std::vector<std::string_view> there{"sse2"};
  // clang 14's __builtin_cpu_supports does not know these two.
  unsigned eax = 0, ebx = 0, ecx = 0, edx = 0;
  const bool f16c = __get_cpuid(1, &eax, &ebx, &ecx, &edx) && (ecx & bit_F16C);
  const bool lzcnt = __get_cpuid(0x80000001, &eax, &ebx, &ecx, &edx) && (ecx & bit_LZCNT);
  const bool sse42 = __builtin_cpu_supports("sse4.2") && __builtin_cpu_supports("popcnt");
  const bool avx = sse42 && __builtin_cpu_supports("avx");
  const bool avx2 = avx && __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma") &&
                    __builtin_cpu_supports("bmi") && __builtin_cpu_supports("bmi2") && lzcnt &&
                    f16c;
  const bool avx512 = avx2 && __builtin_cpu_supports("avx512f") &&
                      __builtin_cpu_supports("avx512cd") && __builtin_cpu_supports("avx512dq") &&
                      __builtin_cpu_supports("avx512bw") && __builtin_cpu_supports("avx512vl");
  if (sse42) there.emplace_back("sse4.2");
  if (avx) there.emplace_back("avx");
  if (avx2) there.emplace_back("avx2");
  if (avx512) there.emplace_back("avx512");
  return there;
#else
  return {"neon"};
#endif
}

}  // namespace ensonify::engine
