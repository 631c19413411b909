#include <ensonify/engine/image/fan_picture.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>

namespace ensonify::engine {
namespace {

/// The place of a bearing among the beams: a whole number on the axis of a beam.
double beam_at(const Sonar& sonar, double bearing_rad) {
  const double edge_rad = 0.5 * sonar.field_of_view_rad;
  const double place = sonar.beam_steps == BeamSteps::angle
                           ? bearing_rad / edge_rad
                           : std::sin(bearing_rad) / std::sin(edge_rad);
  return 0.5 * (place + 1.0) * (sonar.beams - 1);
}

}  // namespace

FanPicture::FanPicture(const Sonar& sonar, std::size_t most_height)
    : beams_(static_cast<std::size_t>(sonar.beams)), bins_(static_cast<std::size_t>(sonar.bins)) {
  constexpr std::size_t least_height = 64;
  height_ = std::clamp(bins_, least_height, std::max(most_height, least_height));
  const double edge_rad = 0.5 * sonar.field_of_view_rad;
  m_per_px_ = sonar.range_m / static_cast<double>(height_);
  const auto side = static_cast<std::size_t>(
      std::ceil(std::sin(std::min(edge_rad, 0.5 * std::numbers::pi)) * sonar.range_m / m_per_px_));
  width_ = 2 * side;
  sources_.resize(width_ * height_);
  for (std::size_t row = 0; row < height_; ++row)
    for (std::size_t column = 0; column < width_; ++column) {
      const double ahead_m = (static_cast<double>(height_ - row) - 0.5) * m_per_px_;
      const double starboard_m =
          (static_cast<double>(column) - static_cast<double>(side) + 0.5) * m_per_px_;
      const double range_m = std::hypot(ahead_m, starboard_m);
      const double bearing_rad = std::atan2(starboard_m, ahead_m);
      if (std::abs(bearing_rad) > edge_rad || range_m >= sonar.range_m) continue;
      const double last_beam = static_cast<double>(beams_) - 1.0,
                   last_bin = static_cast<double>(bins_) - 1.0;
      sources_[row * width_ + column] = {
          static_cast<float>(std::clamp(beam_at(sonar, bearing_rad), 0.0, last_beam)),
          static_cast<float>(std::clamp(range_m / sonar.bin_m() - 0.5, 0.0, last_bin))};
    }
}

std::optional<std::size_t> FanPicture::nearest(std::size_t column, std::size_t row) const {
  const Source& from = sources_[row * width_ + column];
  if (from.beam < 0.0f) return std::nullopt;
  return static_cast<std::size_t>(std::lround(from.beam)) * bins_ +
         static_cast<std::size_t>(std::lround(from.bin));
}

Picture FanPicture::draw(const Picture& waterfall, std::size_t ping) const {
  const auto channels = static_cast<std::size_t>(waterfall.channels),
             bytes = static_cast<std::size_t>(waterfall.bits / 8);
  if (waterfall.width != bins_ || (ping + 1) * beams_ > waterfall.height)
    throw std::invalid_argument("FanPicture: the picture has another number of bins or pings");
  Picture fan{.width = width_,
              .height = height_,
              .channels = waterfall.channels,
              .pixels = std::vector<std::uint8_t>(width_ * height_ * channels * bytes),
              .bits = waterfall.bits};
  const auto value = [&](std::size_t beam, std::size_t bin, std::size_t channel) {
    const std::size_t row = waterfall.height - 1 - (ping * beams_ + beam);  // the newest is on top
    const std::uint8_t* at = &waterfall.pixels[((row * bins_ + bin) * channels + channel) * bytes];
    return bytes == 1 ? static_cast<float>(at[0]) : static_cast<float>(at[0] << 8 | at[1]);
  };
  for (std::size_t i = 0; i < sources_.size(); ++i) {
    const Source& from = sources_[i];
    if (from.beam < 0.0f) continue;
    const auto beam = static_cast<std::size_t>(from.beam), bin = static_cast<std::size_t>(from.bin);
    const std::size_t next_beam = std::min(beam + 1, beams_ - 1),
                      next_bin = std::min(bin + 1, bins_ - 1);
    const float beam_share = from.beam - static_cast<float>(beam),
                bin_share = from.bin - static_cast<float>(bin);
    for (std::size_t channel = 0; channel < channels; ++channel) {
      const float mean = std::lerp(
          std::lerp(value(beam, bin, channel), value(beam, next_bin, channel), bin_share),
          std::lerp(value(next_beam, bin, channel), value(next_beam, next_bin, channel), bin_share),
          beam_share);
      const auto whole = static_cast<unsigned>(std::lround(mean));
      std::uint8_t* to = &fan.pixels[(i * channels + channel) * bytes];
      if (bytes == 2) *to++ = static_cast<std::uint8_t>(whole >> 8);
      *to = static_cast<std::uint8_t>(whole & 0xffu);
    }
  }
  return fan;
}

}  // namespace ensonify::engine
