#include <ensonify/engine/sonar/echo/range_bins.h>

#include <span>

namespace ensonify::engine {

int fill_with_water(std::span<std::uint32_t> regions) {
  const auto number = [](Region region) { return static_cast<std::uint32_t>(region); };
  const auto bed = std::ranges::find_if(regions, [&](std::uint32_t region) {
    return region == number(Region::seabed) || region == number(Region::shadow);
  });
  if (bed == regions.end()) return 0;
  const std::span<std::uint32_t> before_bed(regions.begin(), bed);
  const auto starved = std::ranges::count(before_bed, number(Region::no_data));
  std::ranges::replace(before_bed, number(Region::no_data), number(Region::water_column));
  return static_cast<int>(starved);
}

RangeBins::RangeBins(double bin_m, std::size_t bins)
    : bin_m_(bin_m),
      bins_(bins),
      past_(bins),
      layover_(bins),
      others_(2 * bins),
      first_share_(bins),
      to_{.bins = nullptr, .count = bins, .bin_m = bin_m, .other_room = others_.size()} {}

void RangeBins::reset(const Eigen::Vector3d& abeam) {
  abeam_ = abeam;
  std::fill(bins_.begin(), bins_.end(), EchoBin{});
  std::fill_n(past_.begin(), to_.past_end, PastNadir{});
  std::fill(layover_.begin(), layover_.end(), std::uint8_t{0});
  std::fill(first_share_.begin(), first_share_.end(), -1);
  shares_.clear();
  to_.bins = bins_.data();
  to_.past = past_.data();
  to_.past_end = 0;
  to_.layover = layover_.data();
  to_.others = others_.data();
  to_.other_count = 0;
  to_.visit = 0;
  to_.end = to_.count;
}

void RangeBins::begin_plane() {
  to_.visit = ((to_.visit >> EchoBin::branch_bits) + 1) << EchoBin::branch_bits;
}

void RangeBins::lay(PiecesToLay pieces) {
  const auto is_past = [&](std::size_t i) {
    return Eigen::Map<const Eigen::Vector3d>(pieces.middles + 4 * i).dot(abeam_) < 0.0;
  };
  // A plane's pieces begin at the largest depression.
  pieces.past = 0;
  while (pieces.past < pieces.count && (!pieces.answers[pieces.past] || is_past(pieces.past)))
    ++pieces.past;
  for (std::size_t piece = 0; piece < pieces.count; sort_shares())
    piece = lay_pieces(pieces, piece, to_);
}

/// Adds what lay_pieces() put aside to the lists of the bins.
void RangeBins::sort_shares() {
  for (std::size_t i = 0; i < to_.other_count; ++i) {
    const OtherShare& other = others_[i];
    add_share(other.bin, other.label, other.energy);
  }
  to_.other_count = 0;
}

void RangeBins::add_share(std::size_t bin, std::uint16_t label, double energy) {
  std::int32_t share = first_share_[bin];
  while (share >= 0 && shares_[static_cast<std::size_t>(share)].label != label)
    share = shares_[static_cast<std::size_t>(share)].next;
  if (share < 0) {
    share = static_cast<std::int32_t>(shares_.size());
    shares_.push_back({0.0, first_share_[bin], label});
    first_share_[bin] = share;
  }
  shares_[static_cast<std::size_t>(share)].energy += energy;
}

void RangeBins::add(const ObjectEcho& echo) {
  const double from_m = echo.range_m - echo.spread_m, until_m = echo.range_m + echo.spread_m;
  const std::size_t first = bin_of(from_m), last = bin_of(until_m);
  const bool past = echo.place.dot(abeam_) < 0.0;
  for (std::size_t i = first; i <= last; ++i) {
    const double begins_m = i == first ? from_m : static_cast<double>(i) * bin_m_;
    const double ends_m = i == last ? until_m : static_cast<double>(i + 1) * bin_m_;
    const double share = first == last ? 1.0 : (ends_m - begins_m) / (until_m - from_m);
    const double energy = share * echo.energy;
    EchoBin& bin = bins_[i];
    if (bin.label == EchoBin::no_label)
      bin.label = echo.label;
    else if (bin.label != echo.label)
      add_share(i, echo.label, energy);
    bin.energy += energy;
    if (past) {
      past_[i].energy += energy;
      to_.past_end = std::max(to_.past_end, i + 1);
    }
    std::array<double, 4>& seen = past ? past_[i].seen : bin.seen;
    for (Eigen::Index axis = 0; axis < 3; ++axis)
      seen[static_cast<std::size_t>(axis)] += energy * echo.place[axis];
    seen[3] += energy * echo.grazing_rad;
  }
}

void RangeBins::shade(const Shadow& shadow) {
  const std::uint32_t plane = to_.visit >> EchoBin::branch_bits;
  const std::size_t end = bin_of(shadow.until_m);
  for (std::size_t i = bin_of(shadow.from_m) + 1; i < end; ++i) {
    EchoBin& bin = bins_[i];
    if (bin.visit >> EchoBin::branch_bits == plane || bin.shadow_plane == plane) continue;
    bin.shadow_plane = static_cast<std::uint16_t>(plane);
    bin.shadowed += shadow.beam_weight;
    if (shadow.beam_weight > bin.max_shadow) {
      bin.max_shadow = shadow.beam_weight;
      bin.shadow_label = shadow.label;
    }
  }
}

/// The label with the most of a bin's energy, and how much that is.
std::uint16_t RangeBins::strongest_label(std::size_t bin, double& energy) const {
  auto label = static_cast<std::uint16_t>(bins_[bin].label);
  energy = bins_[bin].energy;
  const std::int32_t first = first_share_[bin];
  for (std::int32_t s = first; s >= 0; s = shares_[static_cast<std::size_t>(s)].next)
    energy -= shares_[static_cast<std::size_t>(s)].energy;
  for (std::int32_t s = first; s >= 0;) {
    const Share& share = shares_[static_cast<std::size_t>(s)];
    if (share.energy > energy) {
      energy = share.energy;
      label = share.label;
    }
    s = share.next;
  }
  return label;
}

/// Sets EchoBin::seen to what it would be if all energy came from one side of nadir. Over a level
/// bed both sides may have nearly the same energy; then the sector's side is taken.
void RangeBins::choose_places() {
  constexpr double least_own = 0.25;  // of the energy from past nadir
  for (std::size_t i = 0; i < to_.past_end; ++i) {
    const auto& [seen, energy] = past_[i];
    if (!(energy > 0.0)) continue;
    EchoBin& bin = bins_[i];
    const double own = bin.energy - energy;
    const bool is_own = own > least_own * energy;
    const double scale = bin.energy / (is_own ? own : energy);
    for (std::size_t k = 0; k < seen.size(); ++k)
      bin.seen[k] = scale * (is_own ? bin.seen[k] : seen[k]);
    past_[i] = {};
  }
}

void RangeBins::write(const FaceLabels& labels, const Eigen::Vector3d& sonar, EchoLine& line) {
  choose_places();
  BinLayers& out = line.bins;
  const std::size_t count = out.region.size();
  write_places(bins_.data(), count, {sonar.x(), sonar.y(), sonar.z()},
               {out.x_m.data(), out.y_m.data(), out.z_m.data(), out.grazing_rad.data()});
  // The layers' addresses, because a loop over the vectors themselves is slower.
  std::uint32_t* const sediment = out.sediment.data();
  std::uint32_t* const class_id = out.class_id.data();
  std::uint32_t* const instance = out.instance.data();
  float* const fraction = out.fraction.data();
  float* const shadow_fraction = out.shadow_fraction.data();
  std::uint32_t* const shadow_instance = out.shadow_instance.data();
  std::uint32_t* const layover = out.layover.data();
  std::uint32_t* const region = out.region.data();
  int first_return = -1, starved = 0;
  std::int32_t looked_up = EchoBin::no_label;
  Label label{};  // whose number is looked_up
  for (std::size_t i = 0; i < count; ++i) {
    const EchoBin& bin = bins_[i];
    const bool lit = bin.energy > 0.0;
    if (lit && first_return < 0) first_return = static_cast<int>(i);
    if (lit) {
      double most = bin.energy;
      std::int32_t strongest = bin.label;
      if (first_share_[i] >= 0) strongest = strongest_label(i, most);
      if (strongest != looked_up) {
        looked_up = strongest;
        label = labels[static_cast<std::uint16_t>(strongest)];
      }
      sediment[i] = label.sediment;
      class_id[i] = label.class_id;
      instance[i] = label.instance;
      fraction[i] = static_cast<float>(most * (1.0 / bin.energy));
    } else {
      sediment[i] = class_id[i] = instance[i] = 0;
      fraction[i] = 0.0f;
    }
    float dark = 0.0f;
    std::uint32_t in_front = 0;
    if (bin.shadowed > 0.0f) {
      dark = bin.shadowed / (bin.lit + bin.shadowed);
      in_front = labels[bin.shadow_label].instance;
    }
    shadow_fraction[i] = dark;
    shadow_instance[i] = in_front;
    layover[i] = layover_[i];

    Region seen = Region::no_data;
    if (first_return < 0)
      seen = Region::water_column;
    else if (dark > 0.5f)
      seen = Region::shadow;
    else if (lit)
      seen = label.instance != 0 && !label.feature ? Region::object : Region::seabed;
    else
      ++starved;
    region[i] = static_cast<std::uint32_t>(seen);
  }
  line.first_return = first_return;
  line.starved = starved;
  if (line.first_return < 0)  // no echo at all, so the end of the water column is not known
    std::fill(out.region.begin(), out.region.end(), static_cast<std::uint32_t>(Region::no_data));
  else
    line.starved -= fill_with_water(out.region);
}

}  // namespace ensonify::engine
