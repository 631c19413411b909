#include <ensonify/engine/recording/xtf_navigation.h>

#include <algorithm>
#include <cstddef>
#include <vector>

#include <fmt/format.h>

#include <ensonify/engine/recording/places.h>

namespace ensonify::engine {
namespace {

/// The track of a ship, and the places behind the ship.
class ShipTrack {
 public:
  ShipTrack(std::vector<Eigen::Vector2d> places, double longest_m) : places_(std::move(places)) {
    const Eigen::Vector2d first = places_.front();
    for (const Eigen::Vector2d& place : places_) {
      const Eigen::Vector2d way = place - first;
      if (way.norm() > farthest_m_) {
        farthest_m_ = way.norm();
        before_ = first - 2.0 * longest_m * way.normalized();
      }
      if (farthest_m_ >= longest_m) break;
    }
  }

  double farthest_m() const { return farthest_m_; }

  /// The place where the ship was when it was `layback_m` away from its place i. Call this with
  /// ascending i, so that the search is short.
  Eigen::Vector2d behind(std::size_t i, double layback_m) {
    const auto away_m = [&](std::size_t k) { return (places_[i] - place_before(k)).norm(); };
    // near_ is the index of the first place that is too near. The place before places_[0] is
    // `before_`, far before the track.
    near_ = std::min(near_, i);
    while (near_ > 0 && away_m(near_) < layback_m) --near_;
    while (near_ < i && away_m(near_ + 1) >= layback_m) ++near_;
    const double far_m = away_m(near_), near_m = away_m(near_ + 1),
                 share = std::clamp((far_m - layback_m) / (far_m - near_m), 0.0, 1.0);
    return place_before(near_) + share * (place_before(near_ + 1) - place_before(near_));
  }

 private:
  const Eigen::Vector2d& place_before(std::size_t k) const {
    return k == 0 ? before_ : places_[k - 1];
  }

  std::vector<Eigen::Vector2d> places_;
  Eigen::Vector2d before_ = Eigen::Vector2d::Zero();
  double farthest_m_ = 0.0;
  std::size_t near_ = 0;
};

}  // namespace

void tow_back(RecordedLine& line, std::string_view name) {
  std::vector<RecordedPing*> towed;  // the pings that have a layback and a place
  std::vector<Eigen::Vector2d> places;
  Eigen::Vector2d scale = Eigen::Vector2d::Ones();
  double longest_m = 0.0, sum_m = 0.0;
  for (RecordedPing& ping : line.pings) {
    if (!ping.layback_m) continue;
    if (ping.place) {
      if (towed.empty()) scale = metres_per_radian(ping.place->latitude_rad);
      places.emplace_back(scale.x() * ping.place->longitude_rad,
                          scale.y() * ping.place->latitude_rad);
    } else if (ping.place_m) {
      places.push_back(*ping.place_m);
    } else {
      continue;
    }
    towed.push_back(&ping);
    longest_m = std::max(longest_m, *ping.layback_m);
    sum_m += *ping.layback_m;
  }
  if (towed.empty()) return;
  ShipTrack track(std::move(places), longest_m);
  constexpr double moves_m = 1.0;
  if (track.farthest_m() < moves_m) {
    line.warnings.push_back(fmt::format(
        "{}: states that the sonar is towed {:.1f} m behind the ship, but the ship does not move; its "
        "place is used",
        name, sum_m / static_cast<double>(towed.size())));
    for (RecordedPing* const ping : towed) ping->layback_m.reset();
    return;
  }
  for (std::size_t k = 0; k < towed.size(); ++k) {
    RecordedPing& ping = *towed[k];
    const Eigen::Vector2d place = track.behind(k, ping.layback_m.value_or(0.0));
    if (ping.place)
      ping.place = GeographicPlace{place.y() / scale.y(), place.x() / scale.x()};
    else
      ping.place_m = place;
  }
  line.warnings.push_back(
      fmt::format("{}: its places are those of the ship; moved back along the track to the towed "
                  "sonar, by {:.1f} m on average, as its pings state",
                  name, sum_m / static_cast<double>(towed.size())));
}

}  // namespace ensonify::engine
