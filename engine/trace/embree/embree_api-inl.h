// Embree 4, or 3 where there is no 4, and all differences between them. It includes Embree's
// headers, so only .cpp files may include it.

#include <type_traits>

#if __has_include(<embree4/rtcore.h>)
#include <embree4/rtcore.h>
#else
#include <embree3/rtcore.h>
#endif

namespace ensonify::engine {

/// A packet of rays that go through the tree together, and their hits.
template <int lanes>
using EmbreePacket = std::conditional_t<lanes == 16, RTCRayHit16,
                                        std::conditional_t<lanes == 8, RTCRayHit8, RTCRayHit4>>;

#if RTC_VERSION_MAJOR >= 4

/// What Embree passes to filters.
using EmbreeContext = RTCRayQueryContext;

/// A query for nearest hits. A filter gets it, or the class derived from it, as its context.
class EmbreeQuery : public EmbreeContext {
 public:
  explicit EmbreeQuery(bool coherent) {
    rtcInitRayQueryContext(this);
    rtcInitIntersectArguments(&arguments_);
    arguments_.context = this;
    arguments_.flags = coherent ? RTC_RAY_QUERY_FLAG_COHERENT : RTC_RAY_QUERY_FLAG_INCOHERENT;
  }
  EmbreeQuery(const EmbreeQuery&) = delete;

  void run(RTCScene scene, RTCRayHit& ray) { rtcIntersect1(scene, &ray, &arguments_); }
  void run(RTCScene scene, const int* valid, RTCRayHit4& rays) {
    rtcIntersect4(valid, scene, &rays, &arguments_);
  }
  void run(RTCScene scene, const int* valid, RTCRayHit8& rays) {
    rtcIntersect8(valid, scene, &rays, &arguments_);
  }
  void run(RTCScene scene, const int* valid, RTCRayHit16& rays) {
    rtcIntersect16(valid, scene, &rays, &arguments_);
  }

 private:
  RTCIntersectArguments arguments_;
};

#else

using EmbreeContext = RTCIntersectContext;

class EmbreeQuery : public EmbreeContext {
 public:
  explicit EmbreeQuery(bool coherent) {
    rtcInitIntersectContext(this);
    flags = coherent ? RTC_INTERSECT_CONTEXT_FLAG_COHERENT : RTC_INTERSECT_CONTEXT_FLAG_INCOHERENT;
  }
  EmbreeQuery(const EmbreeQuery&) = delete;

  void run(RTCScene scene, RTCRayHit& ray) { rtcIntersect1(scene, this, &ray); }
  void run(RTCScene scene, const int* valid, RTCRayHit4& rays) {
    rtcIntersect4(valid, scene, this, &rays);
  }
  void run(RTCScene scene, const int* valid, RTCRayHit8& rays) {
    rtcIntersect8(valid, scene, this, &rays);
  }
  void run(RTCScene scene, const int* valid, RTCRayHit16& rays) {
    rtcIntersect16(valid, scene, this, &rays);
  }
};

#endif

}  // namespace ensonify::engine
