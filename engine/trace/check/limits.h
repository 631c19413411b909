#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <ensonify/engine/trace/check/fan_comparison.h>
#include <ensonify/engine/trace/check/judge.h>

namespace ensonify::engine {

/// The source of a comparison's rays.
enum class RaySource { scene, aimed_fans, aimed_rays, bodies, plumb_lines, faces, bent };
inline constexpr std::array ray_source_names{"scene",       "aimed_fans", "aimed_rays", "bodies",
                                             "plumb_lines", "faces",      "bent"};

/// One line of the table.
struct AgreementRow : AgreementCounts {
  std::string surface, intersector;
  RaySource source = RaySource::scene;
  Precision precision = Precision::exact;
};

/// The largest share of a row's rays that may get a verdict, or be `coarse` or `unlike_static`; a
/// larger share is allowed of few rays, see most_allowed().
struct Limit {
  std::string_view name;
  /// The count that is limited; null: the count of `verdict`, for ties without overlaps.
  std::uint64_t AgreementCounts::*count = nullptr;
  Verdict verdict = Verdict::same;
  double share;
  std::uint64_t of(const AgreementCounts& tally) const {
    if (count) return tally.*count;
    return tally.count(verdict) - (verdict == Verdict::tie ? tally.overlap : 0);
  }
};
/// The limits for rays as in runs (scene, bodies), for rays aimed at weak places, or for bent rays.
std::span<const Limit> limits(RaySource source, Precision precision);
/// How many of `rays` rays the limit allows: its share of them, or of 10,000 rays if there are
/// fewer, and at least one ray; none if the share is 0.
double most_allowed(const Limit& limit, std::uint64_t rays);
bool exceeds(const Limit& limit, const AgreementCounts& tally);
/// The names of the limits that a row exceeds.
std::vector<std::string_view> exceeded_limits(const AgreementRow& row);

}  // namespace ensonify::engine
