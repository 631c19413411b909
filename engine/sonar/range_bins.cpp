#include <ensonify/engine/sonar/range_bins.h>

#include <algorithm>
#include <cmath>

namespace ensonify::engine {

void RangeBins::reset() {
  std::fill(bins_.begin(), bins_.end(), Bin{});
  std::fill(layover_.begin(), layover_.end(), std::uint8_t{0});
  shares_.clear();
  visit_ = 0;
}

void RangeBins::begin_plane() {
  visit_ = (plane() + 1) << branch_bits;
  direction_ = 0;
  turning_bin_ = bins_.size();
  shades_.clear();
}

void RangeBins::lay_across(const Glint& glint, double from_m, double until_m, std::size_t from,
                           std::size_t until) {
  const double per_m = 1.0 / (until_m - from_m);
  const std::size_t step = direction_ > 0 ? 1 : static_cast<std::size_t>(-1);
  const std::size_t edge = direction_ > 0 ? 1 : 0;  // the bin's that is met next
  double begin = 0.0;                               // how far along the way the bin begins, 0 to 1
  for (std::size_t bin = from;; bin += step) {
    const double end =
        bin == until
            ? 1.0
            : std::clamp((static_cast<double>(bin + edge) * bin_m_ - from_m) * per_m, begin, 1.0);
    const double off_middle = 0.5 * (begin + end) - 0.5;
    add(bin, glint.energy * (end - begin) * (1.0 + glint.slant * off_middle),
        glint.middle + off_middle * glint.change, glint);
    if (bin == until) return;
    begin = end;
  }
}

void RangeBins::shade(double from_m, double until_m, float weight, std::uint16_t label) {
  const std::size_t first = bin_of(from_m) + 1, last = bin_of(until_m);
  if (first < last) shades_.push_back({first, last, weight, label});
}

void RangeBins::end_plane() {
  for (const Shade& shade : shades_)
    for (std::size_t i = shade.first; i < shade.last; ++i) {
      Bin& bin = bins_[i];
      if (bin.visit >> branch_bits == plane() || bin.shadow_plane == plane())
        continue;  // seen after all
      bin.shadow_plane = static_cast<std::uint16_t>(plane());
      bin.shadowed += shade.weight;
      if (shade.weight > bin.darkest) {
        bin.darkest = shade.weight;
        bin.blocker = shade.label;
      }
    }
}

// A plane's profile of ranges over elevation is a chain of branches, each running one way. Two
// branches in one bin are layover, but for the bin in which the profile turns.
void RangeBins::come_to(std::size_t index, float weight) {
  Bin& bin = bins_[index];
  if (bin.visit >> branch_bits != plane())
    bin.lit += weight;
  else if (index != turning_bin_)
    layover_[index] = 1;
  bin.visit = visit_;
}

void RangeBins::share(std::size_t index, std::uint16_t label, double energy) {
  Bin& bin = bins_[index];
  if (bin.label == nobody) {
    bin.label = label;
    return;
  }
  if (bin.label != several) {
    first_share_[index] = static_cast<std::int32_t>(shares_.size());
    shares_.push_back({bin.energy, -1, static_cast<std::uint16_t>(bin.label)});
    bin.label = several;
  }
  std::int32_t share = first_share_[index];
  while (share >= 0 && shares_[static_cast<std::size_t>(share)].label != label)
    share = shares_[static_cast<std::size_t>(share)].next;
  if (share < 0) {
    share = static_cast<std::int32_t>(shares_.size());
    shares_.push_back({0.0, first_share_[index], label});
    first_share_[index] = share;
  }
  shares_[static_cast<std::size_t>(share)].energy += energy;
}

void RangeBins::tell(const FaceLabels& labels, const Eigen::Vector3d& sonar, EchoLine& line) const {
  Layers& out = line.bins;
  line.first_return = -1;
  line.starved = 0;
  for (std::size_t i = 0; i < out.region.size(); ++i) {
    const Bin& bin = bins_[i];
    const bool lit = bin.energy > 0.0;
    if (lit && line.first_return < 0) line.first_return = static_cast<int>(i);

    Label label{};
    double most = 0.0;
    if (lit && bin.label != several) {
      most = bin.energy;
      label = labels[static_cast<std::uint16_t>(bin.label)];
    } else if (lit) {
      for (std::int32_t s = first_share_[i]; s >= 0;) {
        const Share& share = shares_[static_cast<std::size_t>(s)];
        if (share.energy > most) {
          most = share.energy;
          label = labels[share.label];
        }
        s = share.next;
      }
    }
    out.sediment[i] = label.sediment;
    out.class_id[i] = label.class_id;
    out.instance[i] = label.instance;
    const double inverse = lit ? 1.0 / bin.energy : 0.0;
    out.fraction[i] = static_cast<float>(most * inverse);
    out.x_m[i] = lit ? static_cast<float>(sonar.x() + bin.seen[0] * inverse) : 0.0f;
    out.y_m[i] = lit ? static_cast<float>(sonar.y() + bin.seen[1] * inverse) : 0.0f;
    out.z_m[i] = lit ? static_cast<float>(sonar.z() + bin.seen[2] * inverse) : 0.0f;
    out.grazing_rad[i] = static_cast<float>(bin.seen[3] * inverse);

    const float weight = bin.lit + bin.shadowed;
    const float dark = weight > 0.0f ? bin.shadowed / weight : 0.0f;
    out.shadow_fraction[i] = dark;
    out.shadow_instance[i] = bin.shadowed > 0.0f ? labels[bin.blocker].instance : 0;
    out.layover[i] = layover_[i];

    Region region = Region::no_data;
    if (line.first_return < 0)
      region = Region::water_column;
    else if (dark > 0.5f)
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
