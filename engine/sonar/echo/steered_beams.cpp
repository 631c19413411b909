#include <ensonify/engine/sonar/echo/steered_beams.h>

#include <cmath>
#include <map>

namespace ensonify::engine {
namespace {

constexpr double rows_per_octave = 12.0;
constexpr double least_nearness = 0.01;  // below it the far field is right within 0.0001 dB

/// The row of a nearness, counted from the far field's; not yet limited to 0.
int row_of_nearness(double nearness) {
  constexpr double least_row = -100.0 * rows_per_octave;
  const double row = rows_per_octave * std::log2(std::max(nearness, 1e-9) / least_nearness);
  return static_cast<int>(std::lround(std::max(row, least_row)));
}

/// By how many rows the nearness of a beam is less than that of a beam on the array's broadside.
int rows_less(double sine) {
  return static_cast<int>(
      std::lround(-rows_per_octave * std::log2(std::max(1.0 - sine * sine, 1e-9))));
}

}  // namespace

SteeredBeams::SteeredBeams(const Sonar& sonar, double wavelength_m, std::size_t bins,
                           const std::function<void()>& stop_check) {
  const LineArray array = sonar.receive_array(wavelength_m);
  x_per_sine_ = array.length_m / wavelength_m;
  std::vector<int> row_of_bin;
  int most = 0;
  for (std::size_t bin = 0; bin < whole_blocks(bins); ++bin) {
    // Nearer than the array is long Fresnel's approximation fails; the beam stays as it is there.
    const double range_m =
        std::max((static_cast<double>(bin) + 0.5) * sonar.bin_m(), array.length_m);
    row_of_bin.push_back(
        row_of_nearness(std::abs(array.nearness(range_m, sonar.defocus(range_m)))));
    most = std::max(most, row_of_bin.back());
  }
  const double lobes_x = array.shading.null_x(sonar.side_lobes + 1);
  std::vector<Row> rows{add_row(array.shading, 0.0, lobes_x, stop_check)};
  for (int row = 1; row <= most; ++row)
    rows.push_back(add_row(array.shading, least_nearness * std::exp2(row / rows_per_octave),
                           lobes_x, stop_check));
  const auto row_at = [&](std::size_t bin, int less) -> const Row& {
    return rows[static_cast<std::size_t>(std::max(row_of_bin[bin] - less, 0))];
  };
  std::map<int, std::size_t> number_of;  // by rows_less()
  for (int beam = 0; beam < sonar.beams; ++beam) {
    sines_.push_back(-std::sin(sonar.bearing_rad(beam)));  // the axis points to port
    const int less = rows_less(sines_.back());
    const auto [known, is_new] = number_of.emplace(less, rows_.size());
    rows_of_beam_.push_back(known->second);
    if (!is_new) continue;
    RowsOfBins& its = rows_.emplace_back();
    for (std::size_t bin = 0; bin < row_of_bin.size(); ++bin) {
      its.first.push_back(static_cast<std::int32_t>(row_at(bin, less).first));
      its.columns.push_back(row_at(bin, less).columns);
    }
  }
  for (std::size_t bin = 0; bin < row_of_bin.size(); bin += steered_block) {
    float widest = 0.0f;
    for (std::size_t i = bin; i < bin + steered_block; ++i)
      widest = std::max(widest, row_at(i, 0).columns);
    reach_of_block_.push_back(double(widest / columns_per_x) / x_per_sine_);
  }
}

SteeredBeams::Row SteeredBeams::add_row(const Shading& shading, double nearness, double lobes_x,
                                        const std::function<void()>& stop_check) {
  const Row row{values_.size() / 2, static_cast<float>(lobes_x + nearness) * columns_per_x};
  for (std::size_t column = 0; column < static_cast<std::size_t>(row.columns) + 2; ++column) {
    if (stop_check && column % 64 == 0) stop_check();
    const std::complex<double> field =
        shading.field(static_cast<double>(column) / double(columns_per_x), nearness);
    values_.push_back(static_cast<float>(field.real()));
    values_.push_back(static_cast<float>(field.imag()));
    is_real_ = is_real_ && values_.back() == 0.0f;
  }
  return row;
}

BeamFields SteeredBeams::fields_of(std::size_t beam) const {
  const RowsOfBins& rows = rows_[rows_of_beam_[beam]];
  return {.values = values_.data(),
          .first = rows.first.data(),
          .columns = rows.columns.data(),
          .is_real = is_real_,
          .axis = static_cast<float>(sines_[beam]),
          .columns_per_sine = static_cast<float>(x_per_sine_) * columns_per_x};
}

std::complex<float> SteeredBeams::field(std::size_t beam, std::size_t bin, double off) const {
  const RowsOfBins& rows = rows_[rows_of_beam_[beam]];
  const float place = static_cast<float>(std::abs(off) * x_per_sine_) * columns_per_x;
  if (!(place < rows.columns[bin])) return 0.0f;
  const auto column = static_cast<std::size_t>(place);
  const float share = place - static_cast<float>(column);
  const float* at = &values_[2 * (static_cast<std::size_t>(rows.first[bin]) + column)];
  return {std::lerp(at[0], at[2], share), std::lerp(at[1], at[3], share)};
}

}  // namespace ensonify::engine
