#include <ensonify/engine/seafloor/layers/roughness.h>

#include <ensonify/engine/base/made_once.h>
#include <ensonify/engine/seafloor/bed/relief_fields.h>
#include <ensonify/engine/seafloor/layers/roughness_in_windows.h>

namespace ensonify::engine {
namespace {

void add_roughness(Heightfield& field, const FractalRelief& relief, const LayerDraws& draws,
                   std::span<const double> /*weight*/) {
  if (draws.roughness)
    draws.roughness->add(field, relief, draws);
  else
    add_fractal(field, relief, draws.of(layer_stream::roughness), draws.control);
}

ReliefKind<FractalRelief> roughness_kind() {
  return {.list = "roughness",
          .help = "A layer of fractal relief, as [seafloor.fractal] is.",
          .purpose = Purpose::roughness_layer,
          .add = &add_roughness,
          .values = {
              {"height_at_1m_m", "m", 0, 100, "Rms height difference of points 1 m apart.",
               &FractalRelief::height_at_1m_m},
              {"hurst", "", 0.01, 0.99, "Hurst exponent: small is jagged, large is rolling.",
               &FractalRelief::hurst},
              {"longest_m", "m", 0, 1e6, "Waves longer than this add no more height; 0: they do.",
               &FractalRelief::longest_m},
          }};
}

}  // namespace

const ReliefKind<FractalRelief>& kind_of(const FractalRelief&) {
  return made_once<roughness_kind>();
}

RoughnessInWindows::RoughnessInWindows(const Heightfield& whole) : whole_(whole) {
  whole_.z_m.clear();
}

void RoughnessInWindows::add(Heightfield& window, const FractalRelief& relief,
                             const LayerDraws& draws) {
  if (relief.height_at_1m_m == 0.0) return;
  FieldInWindows& field = [&]() -> FieldInWindows& {
    const std::lock_guard lock(mutex_);
    std::unique_ptr<FieldInWindows>& its =
        fields_[{draws.number, relief.height_at_1m_m, relief.hurst, relief.longest_m}];
    if (!its)
      its = std::make_unique<FieldInWindows>(whole_, fractal_field(whole_, relief), draws.seed,
                                             draws.purpose, draws.number);
    return *its;
  }();
  field.add(window.first_column, window.first_row, window.columns, window.rows, window.z_m);
}

}  // namespace ensonify::engine
