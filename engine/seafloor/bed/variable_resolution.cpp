#include <ensonify/engine/seafloor/bed/variable_resolution.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>

#include <fmt/format.h>
#include <hdf5.h>

#include <ensonify/engine/seafloor/bed/hdf5_handle-inl.h>
#include <ensonify/refine/triangle_mesh.h>

namespace ensonify::engine {
namespace {

constexpr int max_steps_allowed = 1024;
constexpr hsize_t max_coarse_cells = 1u << 26;
constexpr float missing = 1e6f;  // marks missing heights and uncertainties
constexpr double none = std::numeric_limits<double>::quiet_NaN();

/// Opens a table of a file; -1 if the file is not open.
hid_t open_table(const Hdf5Handle& file, const char* name) {
  return file.is_open() ? H5Dopen2(file.get(), name, H5P_DEFAULT) : -1;
}

/// The size of a table with two dimensions; zeros for any other table.
std::array<hsize_t, 2> size_of(const Hdf5Handle& table) {
  std::array<hsize_t, 2> size{};
  const Hdf5Handle space(table.is_open() ? H5Dget_space(table.get()) : -1, H5Sclose);
  if (!space.is_open() || H5Sget_simple_extent_ndims(space.get()) != 2 ||
      H5Sget_simple_extent_dims(space.get(), size.data(), nullptr) != 2)
    return {0, 0};
  return size;
}

}  // namespace

struct VariableResolution::File {
  explicit File(const std::filesystem::path& file)
      : all(H5Fopen(file.c_str(), H5F_ACC_RDONLY, H5P_DEFAULT), H5Fclose),
        metadata(open_table(all, "/BAG_root/varres_metadata"), H5Dclose),
        points(open_table(all, "/BAG_root/varres_refinements"), H5Dclose),
        point_count(size_of(points)[0] == 1 ? size_of(points)[1] : 0) {}
  Hdf5Handle all, metadata, points;
  hsize_t point_count;
};

VariableResolution::VariableResolution(const std::filesystem::path& file, double coarse_east_m,
                                       double coarse_north_m)
    : name_(file.string()),
      file_(std::make_unique<File>(file)),
      coarse_east_m_(coarse_east_m),
      coarse_north_m_(coarse_north_m) {
  const auto [rows, columns] = size_of(file_->metadata);
  if (rows < 1 || columns < 1 || rows > max_coarse_cells || columns > max_coarse_cells / rows ||
      file_->point_count == 0)
    fail();
  coarse_rows_ = static_cast<int>(rows);
  coarse_columns_ = static_cast<int>(columns);

  const Hdf5Handle type(H5Tcreate(H5T_COMPOUND, sizeof(Refinement)), H5Tclose);
  const auto insert = [&](const char* name, std::size_t place, hid_t as) {
    H5Tinsert(type.get(), name, place, as);
  };
  insert("index", offsetof(Refinement, first), H5T_NATIVE_UINT32);
  insert("dimensions_x", offsetof(Refinement, across), H5T_NATIVE_UINT32);
  insert("dimensions_y", offsetof(Refinement, up), H5T_NATIVE_UINT32);
  insert("resolution_x", offsetof(Refinement, cell_east_m), H5T_NATIVE_FLOAT);
  insert("resolution_y", offsetof(Refinement, cell_north_m), H5T_NATIVE_FLOAT);
  insert("sw_corner_x", offsetof(Refinement, west_m), H5T_NATIVE_FLOAT);
  insert("sw_corner_y", offsetof(Refinement, south_m), H5T_NATIVE_FLOAT);
  refinements_.resize(rows * columns, Refinement{});
  if (H5Dread(file_->metadata.get(), type.get(), H5S_ALL, H5S_ALL, H5P_DEFAULT,
              refinements_.data()) < 0)
    fail();

  double finest_m = std::numeric_limits<double>::infinity();
  for (Refinement& its : refinements_) {
    if (its.across == 0 || its.up == 0) {
      its = {};
      continue;
    }
    const std::uint64_t count = std::uint64_t{its.across} * its.up;
    if (!(its.cell_east_m > 0.0f && its.cell_north_m > 0.0f && its.cell_east_m <= coarse_east_m &&
          its.cell_north_m <= coarse_north_m && std::isfinite(its.west_m) &&
          std::isfinite(its.south_m)) ||
        its.first >= file_->point_count || count > file_->point_count - its.first)
      fail();
    finest_m = std::min({finest_m, double{its.cell_east_m}, double{its.cell_north_m}});
  }
  if (!std::isfinite(finest_m)) fail();
  finest_m_ = finest_m;
  for (Refinement& its : refinements_) {
    const double steps = std::round(std::max(its.cell_east_m, its.cell_north_m) / finest_m_);
    its.steps = static_cast<int>(std::clamp(steps, 1.0, double{max_steps_allowed}));
    max_steps_ = std::max(max_steps_, its.steps);
  }
}

VariableResolution::~VariableResolution() = default;

void VariableResolution::fail() const {
  throw refine::MeshError(
      fmt::format("{}: its tables of refinements (/BAG_root/varres_...) are damaged", name_));
}

double VariableResolution::columns() const {
  return std::floor(coarse_columns_ * coarse_east_m_ / finest_m_ + 1e-6);
}
double VariableResolution::rows() const {
  return std::floor(coarse_rows_ * coarse_north_m_ / finest_m_ + 1e-6);
}

/// The column or row of the coarse grid at the middle of a column or row of the finest cells.
int VariableResolution::coarse_column(int column) const {
  const auto at = static_cast<int>((column + 0.5) * finest_m_ / coarse_east_m_);
  return std::clamp(at, 0, coarse_columns_ - 1);
}
int VariableResolution::coarse_row(int row) const {
  const auto at = static_cast<int>((row + 0.5) * finest_m_ / coarse_north_m_);
  return std::clamp(at, 0, coarse_rows_ - 1);
}

const VariableResolution::Refinement& VariableResolution::refinement(int coarse_column,
                                                                     int coarse_row) const {
  return refinements_[static_cast<std::size_t>(coarse_row) *
                          static_cast<std::size_t>(coarse_columns_) +
                      static_cast<std::size_t>(coarse_column)];
}

/// The values of a refinement, row by row from the south-west.
std::vector<float> VariableResolution::points(What what, const Refinement& refinement) const {
  std::vector<float> values(std::size_t{refinement.across} * refinement.up);
  const Hdf5Handle type(H5Tcreate(H5T_COMPOUND, sizeof(float)), H5Tclose);
  H5Tinsert(type.get(), what == What::height ? "depth" : "depth_uncrt", 0, H5T_NATIVE_FLOAT);
  const std::array<hsize_t, 2> first{0, refinement.first}, count{1, values.size()};
  const Hdf5Handle from(H5Dget_space(file_->points.get()), H5Sclose);
  const Hdf5Handle to(H5Screate_simple(2, count.data(), nullptr), H5Sclose);
  if (!from.is_open() || !to.is_open() ||
      H5Sselect_hyperslab(from.get(), H5S_SELECT_SET, first.data(), nullptr, count.data(),
                          nullptr) < 0 ||
      H5Dread(file_->points.get(), type.get(), to.get(), from.get(), H5P_DEFAULT, values.data()) <
          0)
    fail();
  return values;
}

/// For each finest cell the value of the nearest point of the refinement there. So the values have
/// steps as large as the refinement's cells.
void VariableResolution::read_steps(What what, const Window& window,
                                    std::span<double> values) const {
  std::ranges::fill(values, none);
  const int last_column = coarse_column(window.first_column + window.columns - 1);
  const int last_row = coarse_row(window.first_row + window.rows - 1);
  for (int y = coarse_row(window.first_row); y <= last_row; ++y)
    for (int x = coarse_column(window.first_column); x <= last_column; ++x) {
      const Refinement& finer = refinement(x, y);
      if (finer.across == 0) continue;
      const std::vector<float> points = this->points(what, finer);
      // The index of the nearest point, up to a cell beyond the outer points; -1 farther away.
      const auto nearest = [](double from_first_m, float cell_m, std::uint32_t count) {
        const double at = std::floor(from_first_m / cell_m + 0.5);
        if (at < -1.0 || at > count) return -1;
        return static_cast<int>(std::clamp(at, 0.0, count - 1.0));
      };
      // The cells whose middles lie in the coarse cell.
      const auto begin = [&](int at, double coarse_m, int first) {
        return std::max(first, static_cast<int>(std::ceil(at * coarse_m / finest_m_ - 0.5)));
      };
      const int end_row =
          std::min(begin(y + 1, coarse_north_m_, 0), window.first_row + window.rows);
      const int end_column =
          std::min(begin(x + 1, coarse_east_m_, 0), window.first_column + window.columns);
      for (int row = begin(y, coarse_north_m_, window.first_row); row < end_row; ++row) {
        const int j = nearest((row + 0.5) * finest_m_ - y * coarse_north_m_ - finer.south_m,
                              finer.cell_north_m, finer.up);
        if (j < 0) continue;
        for (int column = begin(x, coarse_east_m_, window.first_column); column < end_column;
             ++column) {
          const int i = nearest((column + 0.5) * finest_m_ - x * coarse_east_m_ - finer.west_m,
                                finer.cell_east_m, finer.across);
          if (i < 0) continue;
          const float value =
              points[static_cast<std::size_t>(j) * finer.across + static_cast<std::size_t>(i)];
          if (std::isfinite(value) && value != missing)
            values[static_cast<std::size_t>(row - window.first_row) *
                       static_cast<std::size_t>(window.columns) +
                   static_cast<std::size_t>(column - window.first_column)] = value;
        }
      }
    }
}

/// For each place the mean over a square that is as large as the step there. This is linear
/// interpolation between the points. Places without a value keep none and are left out of means.
void VariableResolution::smooth(const Window& outer, std::span<const double> steps,
                                const Window& inner, std::span<double> values) const {
  // For each point the sum and the number of the values at all places south-west of it.
  const auto stride = static_cast<std::size_t>(outer.columns) + 1;
  std::vector<double> sum(stride * (static_cast<std::size_t>(outer.rows) + 1), 0.0);
  std::vector<double> count(sum.size(), 0.0);
  for (std::size_t row = 0; row < static_cast<std::size_t>(outer.rows); ++row)
    for (std::size_t column = 0; column + 1 < stride; ++column) {
      const double value = steps[row * (stride - 1) + column];
      const std::size_t at = (row + 1) * stride + column + 1;
      const auto add = [&](std::vector<double>& sums, double more) {
        sums[at] = more + sums[at - 1] + sums[at - stride] - sums[at - stride - 1];
      };
      add(sum, std::isnan(value) ? 0.0 : value);
      add(count, std::isnan(value) ? 0.0 : 1.0);
    }
  const auto clamped = [](int place, int first, int size) {
    return static_cast<std::size_t>(std::clamp(place - first, 0, size));
  };
  for (int row = 0; row < inner.rows; ++row)
    for (int column = 0; column < inner.columns; ++column) {
      const int x = inner.first_column + column, y = inner.first_row + row;
      double& to = values[static_cast<std::size_t>(row) * static_cast<std::size_t>(inner.columns) +
                          static_cast<std::size_t>(column)];
      to = steps[static_cast<std::size_t>(y - outer.first_row) * (stride - 1) +
                 static_cast<std::size_t>(x - outer.first_column)];
      const int side = refinement(coarse_column(x), coarse_row(y)).steps;
      if (side == 1 || std::isnan(to)) continue;
      // A square with an even side has no cell in its middle. Then the mean of the four squares
      // that are half a cell off is used.
      double total = 0.0, places = 0.0;
      for (int north = 0; north <= (side + 1) % 2; ++north)
        for (int east = 0; east <= (side + 1) % 2; ++east) {
          const int west = x - side / 2 + east, south = y - side / 2 + north;
          const std::size_t left = clamped(west, outer.first_column, outer.columns);
          const std::size_t right = clamped(west + side, outer.first_column, outer.columns);
          const std::size_t below = clamped(south, outer.first_row, outer.rows) * stride;
          const std::size_t above = clamped(south + side, outer.first_row, outer.rows) * stride;
          const auto within = [&](const std::vector<double>& sums) {
            return sums[above + right] - sums[above + left] - sums[below + right] +
                   sums[below + left];
          };
          total += within(sum);
          places += within(count);
        }
      to = total / places;
    }
}

void VariableResolution::read(What what, const Window& window, std::span<double> values) const {
  // In strips of rows, so that the working memory is small compared with the values.
  constexpr int strip_rows = 512;
  const int margin = max_steps_ / 2 + 1;
  const auto across = static_cast<std::size_t>(window.columns);
  for (int done = 0; done < window.rows; done += strip_rows) {
    const Window strip{window.first_column, window.first_row + done, window.columns,
                       std::min(strip_rows, window.rows - done)};
    const auto around = [&](int first, int count, double all, int& from, int& number) {
      from = std::max(0, first - margin);
      number = static_cast<int>(std::min(all, static_cast<double>(first) + count + margin)) - from;
    };
    Window outer;
    around(strip.first_column, strip.columns, columns(), outer.first_column, outer.columns);
    around(strip.first_row, strip.rows, rows(), outer.first_row, outer.rows);
    std::vector<double> steps(static_cast<std::size_t>(outer.columns) *
                              static_cast<std::size_t>(outer.rows));
    read_steps(what, outer, steps);
    smooth(outer, steps, strip,
           values.subspan(static_cast<std::size_t>(done) * across,
                          static_cast<std::size_t>(strip.rows) * across));
  }
}

}  // namespace ensonify::engine
