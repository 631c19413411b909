#include <ensonify/engine/sonar/plane_beam.h>

#include <algorithm>

namespace ensonify::engine {
namespace {

constexpr double widest_rad = 0.017453292519943295;  // of a cell: a degree
constexpr float dark = 1e-3f;

}  // namespace

void PlaneBeam::begin(const Beam& beam, const RayFan& fan, const Aperture& aperture,
                      const Reception& reception, Side side) {
  beam_ = &beam;
  fan_ = &fan;
  aperture_ = &aperture;
  reception_ = &reception;
  side_ = side;
}

void PlaneBeam::begin_plane(std::size_t plane) {
  plane_ = plane;
  const auto side = static_cast<std::size_t>(side_);
  const bool fixed = reception_->still && beam_->focused();
  table_ = fixed ? &aperture_->weight[side][plane * fan_->elevations()] : nullptr;
  sent_ = &aperture_->vertical[side][plane * fan_->elevations()];
  cell_ = {};
  right_ = {};
}

// A new cell, from the last one's end if the ray is right behind it.
void PlaneBeam::move_to(std::size_t elevation) {
  const FanGrid& grid = *fan_->grid;
  const bool follows = cell_.last >= cell_.first && elevation > cell_.last &&
                       elevation - cell_.last <= most_rays &&
                       grid.elevation_rad[elevation] - grid.elevation_rad[cell_.last] <= widest_rad;
  const std::size_t first = follows ? cell_.last : elevation;
  std::size_t last = first;
  while (last + 1 < fan_->elevations() && last - first < most_rays &&
         grid.within_beam(plane_, last + 1) &&
         grid.elevation_rad[last + 1] - grid.elevation_rad[first] <= widest_rad)
    ++last;
  last = std::max(last, elevation);
  left_ = follows ? right_ : Edge{};
  right_ = {};
  cell_ = {first, last, last > first ? 1.0 / static_cast<double>(last - first) : 0.0,
           std::min(sent_[first], sent_[last]) < dark};
}

void PlaneBeam::fill(Edge& edge, std::size_t elevation, std::uint64_t row) const {
  const double sent = sent_[elevation];
  const auto at = [&](std::uint64_t bits) {
    return two_way(elevation, std::bit_cast<double>(bits << step_bits)) / (sent * sent);
  };
  const std::size_t place = row % kept, before = (row - 1) % kept, after = (row + 1) % kept;
  edge.near[place] = edge.row[before] == row - 1 ? edge.far[before] : at(row);
  edge.far[place] = edge.row[after] == row + 1 ? edge.near[after] : at(row + 1);
  edge.row[place] = row;
}

double PlaneBeam::two_way(std::size_t elevation, double range_m) const {
  return beam_->two_way(side_, aperture_->samples_of(plane_), fan_->grid->cos_elevation[elevation],
                        sent_[elevation], fan_->direction(fan_->plane_direction(plane_), elevation),
                        range_m, *reception_);
}

}  // namespace ensonify::engine
