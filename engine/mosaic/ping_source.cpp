#include <ensonify/engine/mosaic/ping_source.h>

#include <cstdint>
#include <span>

#include <ensonify/engine/image/line_layout.h>
#include <ensonify/engine/sonar/echo/echo.h>
#include <ensonify/engine/sonar/reception/recorder.h>

namespace ensonify::engine {

PingSource::PingSource(Positions positions, const std::string& layer)
    : positions_(positions), power_(layer == "brightness") {
  if (positions == Positions::truth) layers_ = {"x_m", "y_m"};
  value_ = layers_.size();
  if (layer != "region") layers_.push_back(power_ ? "sample" : layer);
  layers_.emplace_back("region");
  rows_.resize(layers_.size());
}

std::vector<ShownPing> PingSource::read(const RecordedRun& run, std::size_t begin,
                                        std::size_t end) {
  std::vector<ShownPing> pings;
  while (begin < end) {
    const std::uint32_t image = run.pings[begin].image;
    std::size_t behind = begin;  // becomes the first ping of the next image
    while (behind < end && run.pings[behind].image == image) ++behind;
    if (file_ != run.images[image]) {
      image_ = std::make_unique<ImageReader>(run.images[image]);
      file_ = run.images[image];
    }
    image_->read(run.pings[begin].row, behind - begin, layers_, rows_);
    for (std::size_t i = begin; i < behind; ++i)
      pings.push_back(shown(run, run.pings[i], i - begin));
    begin = behind;
  }
  return pings;
}

ShownPing PingSource::shown(const RecordedRun& run, const MosaicPing& ping, std::size_t row) const {
  const Recorder recorder(run.sonar.receiver, 0.0, 0, 0.0, 0.0);  // only its transfer curve is used
  const std::span<const Sector> sectors = run.sonar.sectors();
  const LineLayout layout(run.sonar);
  ShownPing result(sectors.size());
  for (std::size_t s = 0; s < sectors.size(); ++s) {
    const auto near_to_far = [&](const std::vector<float>& layer) {
      std::vector<float> values(layout.bins());
      layout.get(s, layer.begin() + static_cast<std::ptrdiff_t>(row * layout.columns()),
                 values.begin());
      return values;
    };
    GroundLayers ground{.region = near_to_far(rows_.back()), .x_m = {}, .y_m = {}};
    if (positions_ == Positions::truth) {
      ground.x_m = near_to_far(rows_[0]);
      ground.y_m = near_to_far(rows_[1]);
    }
    ShownSide& line = result[s];
    line.ground = place(ping, run.sonar, sectors[s], positions_, ground);
    line.values = near_to_far(rows_[value_]);
    for (float& value : line.values)
      if (power_) {
        // A damaged image may have any values, also NaN.
        const bool is_sample = value >= 0.0f && value <= static_cast<float>(recorder.full_scale());
        const double amplitude =
            is_sample ? recorder.amplitude(static_cast<std::uint32_t>(value)) : 0.0;
        value = static_cast<float>(amplitude * amplitude);
      }
    for (const float region : ground.region)
      line.lit.push_back(region == static_cast<float>(Region::seabed) ||
                         region == static_cast<float>(Region::object));
  }
  return result;
}

}  // namespace ensonify::engine
