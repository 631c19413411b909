#include <ensonify/engine/sonar/echo/steered_beams.h>

namespace ensonify::engine {
namespace {

constexpr double rows_per_octave = 12.0;
constexpr double least_nearness = 0.01;  // below it the far field is right within 0.0001 dB

/// The row, counted from the far field's, for a nearness; not yet limited to 0.
double row_of_nearness(double nearness) {
  return rows_per_octave * std::log2(nearness / least_nearness);
}

}  // namespace

SteeredBeams::SteeredBeams(const Sonar& sonar, double wavelength_m, std::size_t bins) {
  const LineArray array = sonar.receive_array(wavelength_m);
  x_per_sine_ = array.length_m / wavelength_m;
  for (int beam = 0; beam < sonar.beams; ++beam)
    sines_.push_back(-std::sin(sonar.bearing_rad(beam)));  // the axis points to port
  const double lobes_x = array.shading.null_x(sonar.side_lobes + 1);
  add_row(array.shading, 0.0, lobes_x);
  int most = 0;
  for (std::size_t bin = 0; bin < bins; ++bin) {
    // Nearer than the array is long Fresnel's approximation fails; the beam stays as it is there.
    const double range_m =
        std::max((static_cast<double>(bin) + 0.5) * sonar.bin_m(), array.length_m);
    const double nearness = std::abs(array.nearness(range_m, sonar.defocus(range_m)));
    const double row =
        std::max(row_of_nearness(std::max(nearness, 1e-9)), -100.0 * rows_per_octave);
    row_of_bin_.push_back(static_cast<int>(std::lround(row)));
    most = std::max(most, row_of_bin_.back());
  }
  for (const double sine : sines_)
    row_of_beam_.push_back(static_cast<int>(
        std::lround(rows_per_octave * std::log2(std::max(1.0 - sine * sine, 1e-9)))));
  for (int row = 1; row <= most; ++row)
    add_row(array.shading, least_nearness * std::exp2(row / rows_per_octave), lobes_x);
}

void SteeredBeams::add_row(const Shading& shading, double nearness, double lobes_x) {
  const double reach_x = lobes_x + nearness;
  const Row row{values_.size(), static_cast<float>(reach_x) * columns_per_x};
  for (std::size_t column = 0; column < static_cast<std::size_t>(row.columns) + 2; ++column)
    values_.push_back(std::complex<float>(
        shading.field(static_cast<double>(column) / double(columns_per_x), nearness)));
  rows_.push_back(row);
  widest_ = std::max(widest_, static_cast<float>(reach_x / x_per_sine_));
}

void SteeredBeams::cut_runs(const float* sines, std::size_t bins, Scratch& scratch) const {
  const auto steps_per_sine = static_cast<float>(128.0 * x_per_sine_);
  scratch.runs.clear();
  float last = 0.0f;
  for (std::size_t bin = 0; bin < bins; ++bin) {
    const float step = std::nearbyint(sines[bin] * steps_per_sine);
    const bool same_row = rows_.size() == 1 || bin == 0 || row_of_bin_[bin] == row_of_bin_[bin - 1];
    if (!scratch.runs.empty() && step == last && same_row)
      scratch.runs.back().until = bin + 1;
    else
      scratch.runs.push_back({bin, bin + 1, step / steps_per_sine});
    last = step;
  }
}

}  // namespace ensonify::engine
