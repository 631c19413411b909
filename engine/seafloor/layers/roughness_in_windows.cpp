#include <ensonify/engine/seafloor/layers/roughness_in_windows.h>

#include <ensonify/engine/seafloor/bed/relief_fields.h>

namespace ensonify::engine {

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
