#include <ensonify/engine/sonar/range_bins.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace ensonify::engine {

double Sight::plane_range_m(const Eigen::Vector3d& other) const {
  const double towards = normal.dot(other);
  if (towards >= 0.0) return std::numeric_limits<double>::infinity();
  return range_m * normal.dot(direction) / towards;
}

void RangeBins::reset() {
  std::fill(bins_.begin(), bins_.end(), Bin{});
  heap_ = {};
  shares_.clear();
  plane_ = 0;
}

void RangeBins::begin_plane() {
  ++plane_;
  branch_ = 0;
  direction_ = 0;
  turning_bin_ = bins_.size();
  shades_.clear();
}

void RangeBins::spread_far(const Sight& from, const Sight& to, double step_rad) {
  const double reach = to.range_m - from.range_m;
  const Eigen::Vector3d way = to.place - from.place;
  double begin = 0.0;  // how far along the way the bin begins, 0 to 1
  for (std::size_t bin = from.bin;; bin += static_cast<std::size_t>(direction_)) {
    const double edge_m = static_cast<double>(direction_ > 0 ? bin + 1 : bin) * bin_m_;
    const double end =
        bin == to.bin ? 1.0 : std::clamp((edge_m - from.range_m) / reach, begin, 1.0);
    const double middle = 0.5 * (begin + end);
    const double density = from.density + middle * (to.density - from.density);
    const double grazing = from.grazing_rad + middle * (to.grazing_rad - from.grazing_rad);
    add(bin, density * (end - begin) * step_rad, middle < 0.5 ? from : to,
        from.place + middle * way, grazing);
    if (bin == to.bin) return;
    begin = end;
  }
}

void RangeBins::settle(const Sight& sight, double step_rad) {
  turn(0, sight.bin);
  if (sight.density <= 0.0) return;
  add(sight.bin, 0.5 * sight.density * step_rad, sight, sight.place, sight.grazing_rad);
}

void RangeBins::shade(const Sight& blocker, double to_range_m, float weight) {
  const std::size_t first = blocker.bin + 1;
  const std::size_t last = bin_of(to_range_m);
  if (first < last) shades_.push_back({first, last, weight, blocker.label});
}

void RangeBins::end_plane() {
  end_heap();
  for (const Shade& shade : shades_)
    for (std::size_t i = shade.first; i < shade.last; ++i) {
      Bin& bin = bins_[i];
      if (bin.plane == plane_ || bin.shadow_plane == plane_) continue;  // seen after all
      bin.shadow_plane = plane_;
      bin.shadowed += shade.weight;
      if (shade.weight > bin.darkest) {
        bin.darkest = shade.weight;
        bin.blocker = shade.label;
      }
    }
}

void RangeBins::begin_heap(std::size_t index, const Sight& sight) {
  end_heap();
  Bin& bin = bins_[index];
  if (bin.plane != plane_) {
    bin.plane = plane_;
    bin.seen += sight.weight;
  } else if (bin.branch != branch_ && index != turning_bin_) {
    bin.layover = true;
  }
  bin.branch = branch_;
  heap_.bin = index;
  heap_.branch = branch_;
  heap_.label = sight.label;
}

void RangeBins::end_heap() {
  if (heap_.branch == 0) return;
  Bin& bin = bins_[heap_.bin];
  bin.energy += heap_.energy;
  bin.place += heap_.place;
  bin.grazing += heap_.grazing;
  std::int32_t share = bin.first_share;
  while (share >= 0 && shares_[static_cast<std::size_t>(share)].label != heap_.label)
    share = shares_[static_cast<std::size_t>(share)].next;
  if (share < 0) {
    share = static_cast<std::int32_t>(shares_.size());
    shares_.push_back({0.0, bin.first_share, heap_.label});
    bin.first_share = share;
  }
  shares_[static_cast<std::size_t>(share)].energy += heap_.energy;
  heap_ = {};
}

// A plane's profile of ranges over elevation is a chain of branches, each running one way. Two
// branches in one bin are layover, but for the bin in which the profile turns.
void RangeBins::turn(int direction, std::size_t bin) {
  if (direction == direction_ && direction != 0) return;
  ++branch_;
  direction_ = direction;
  turning_bin_ = bin;
}

void RangeBins::tell(const FaceLabels& labels, EchoLine& line) const {
  Layers& out = line.bins;
  line.first_return = -1;
  line.starved = 0;
  for (std::size_t i = 0; i < out.region.size(); ++i) {
    const Bin& bin = bins_[i];
    const bool lit = bin.energy > 0.0;
    if (lit && line.first_return < 0) line.first_return = static_cast<int>(i);

    Label label{};
    double most = 0.0;
    for (std::int32_t s = bin.first_share; s >= 0;) {
      const Share& share = shares_[static_cast<std::size_t>(s)];
      if (share.energy > most) {
        most = share.energy;
        label = labels[share.label];
      }
      s = share.next;
    }
    out.sediment[i] = label.sediment;
    out.class_id[i] = label.class_id;
    out.instance[i] = label.instance;
    out.fraction[i] = lit ? static_cast<float>(most / bin.energy) : 0.0f;
    const Eigen::Vector3d place =
        lit ? Eigen::Vector3d(bin.place / bin.energy) : Eigen::Vector3d::Zero();
    out.x_m[i] = static_cast<float>(place.x());
    out.y_m[i] = static_cast<float>(place.y());
    out.z_m[i] = static_cast<float>(place.z());
    out.grazing_rad[i] = lit ? static_cast<float>(bin.grazing / bin.energy) : 0.0f;

    const double weight = bin.seen + bin.shadowed;
    const double dark = weight > 0.0 ? bin.shadowed / weight : 0.0;
    out.shadow_fraction[i] = static_cast<float>(dark);
    out.shadow_instance[i] = bin.shadowed > 0.0 ? labels[bin.blocker].instance : 0;
    out.layover[i] = bin.layover;

    Region region = Region::no_data;
    if (line.first_return < 0)
      region = Region::water_column;
    else if (dark > 0.5)
      region = Region::shadow;
    else if (lit)
      region = label.instance != 0 && !label.feature ? Region::object : Region::seabed;
    else
      ++line.starved;
    out.region[i] = static_cast<std::uint32_t>(region);
  }
  if (line.first_return < 0)  // nothing at all: not even water that an echo ends
    std::fill(out.region.begin(), out.region.end(), static_cast<std::uint32_t>(Region::no_data));
}

}  // namespace ensonify::engine
