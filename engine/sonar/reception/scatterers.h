#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include <Eigen/Core>

#include <ensonify/engine/sonar/reception/textured_ground.h>

namespace ensonify::engine {

/// The position and axes of an array.
struct ArrayFrame {
  Eigen::Vector3d origin = Eigen::Vector3d::Zero();  ///< local metres
  Eigen::Vector3d axis = Eigen::Vector3d::UnitY();   ///< unit, along the array
  Eigen::Vector3d down = -Eigen::Vector3d::UnitZ();  ///< unit, across the array: the sonar's down
};

/// The scatterers of the ground, and their sum over an array's beam.
///
/// The ground is divided into cells. Across the array a cell is one bin long. Along the array it is
/// a 1024th of the array's length, times the power of two with which 8 to 16 cells span the beam.
/// Each cell holds one scatterer of complex normal strength at a random place along the array; both
/// depend only on the seed, the frequency and the cell. A bin is the sum over the cells on its
/// line, which is parallel to the array, that the beam covers. Each cell is weighted with the
/// complex two-way pattern there (the array's Fresnel integral, transmitter times receiver) and has
/// the phase of its place across the array. So the correlation of two pings, or of two passes,
/// follows theory: along the track it is the Fourier transform of the squared pattern (van Cittert
/// and Zernike), across it it falls with a change of the grazing angle. The sum is divided by the
/// root of the sum of its squared weights, so each bin has the variance 1.
///
/// Cells are aligned with one of 12 directions, 15 degrees apart: the direction nearest to the
/// array's axis or to its opposite. (Two passes whose headings differ by more than the beam are
/// uncorrelated anyway.) The directions are fixed to the ground: 0, 15, 30 degrees and so on, or
/// the angles halfway between. The set is used for which the usual heading is farther from the
/// angles at which the nearest direction changes. So runs on the same or the opposite heading see
/// the same scatterers. If the array is not aligned with the rows of cells, a line crosses them,
/// and a scatterer changes its bin as the array moves across its axis. The phase that a change of
/// height causes is taken to be the same for the whole line.
///
/// On a ground with patches (TexturedGround), a scatterer's strength is multiplied by the strength
/// of its patch, whose mean is 1. Then the variance of a bin is the mean of its patches' strengths
/// over the beam, and its mean over all ground is 1. On objects, a change of height counts like a
/// horizontal distance over patches, because a wall lies over hardly any ground.
class Scatterers {
 public:
  /// reference_heading_rad: heading of most pings. farthest_m: farthest range of width_m_at(); at
  /// least the sonar's range. stop_check is called often; what it throws ends the constructor.
  Scatterers(const Sonar& sonar, double sound_speed_mps, std::uint64_t seed,
             double reference_heading_rad,
             const std::vector<scatter::GroundTexture>& by_material = {}, double farthest_m = 0.0,
             const std::function<void()>& stop_check = {});

  /// The scatterers of the planes of a fan, for beams that are steered: each plane sums those that
  /// lie nearer to it than to its neighbours, all with the same weight. The cells are so long that
  /// 2 to 4 of them span a plane, so a plane has at least one scatterer, and planes share none.
  /// sine_step: from each plane to the next, as sine of azimuth.
  /// least_cosine: of the planes' azimuths.
  static Scatterers of_planes(const Sonar& sonar, double sound_speed_mps, std::uint64_t seed,
                              double reference_heading_rad,
                              const std::vector<scatter::GroundTexture>& by_material,
                              double sine_step, double least_cosine);
  /// The table that place() and gather() need for a plane with this cosine of azimuth.
  std::size_t table_of(double cos_azimuth) const;

  /// One thread's working memory for gather(), reused from ping to ping.
  struct Scratch {
    std::uint32_t frame_key = 0;
    /// How far a line parallel to the array moves across the cells per length along them.
    double skew = 0.0;
    std::vector<std::uint32_t> across_cell, across_within, first_cell, cells, placeless;
    std::vector<float> first_column, phase_turns;
    TexturedGround::Places patches;
  };
  /// Finds the cells of each bin whose intensity_mean is above 0, from the places in `bins`.
  void place(const ArrayFrame& array_frame, const BinLayers& bins, Scratch& scratch,
             std::size_t table = 0) const;
  /// The complex field of one look, with the variance `power` in each bin; 0 where a bin has no
  /// cells. All arrays have whole groups of bins (signal_kernel.h). The first look after place()
  /// keeps the patches' strengths for the others.
  void gather(Scratch& scratch, int look, std::span<const float> power, float* re, float* im,
              std::size_t table = 0) const;
  const TexturedGround& ground() const { return ground_; }
  /// Integral of the two-way power pattern along the array, m, at a bin's range.
  double width_m(std::size_t bin) const { return width_of_bin_m_[bin]; }
  /// width_m() at any range. It is proportional to the range below the arrays' length and beyond
  /// farthest_m.
  double width_m_at(double range_m) const;
  /// The share of width_m() between two distances along the array from its middle.
  double width_share(std::size_t bin, double from_m, double until_m) const;

 private:
  static constexpr int columns_per_cell = 32;
  struct Row {  ///< the weights for a small interval of ranges
    double cells_per_m;
    float reach;  ///< cells on either side
    int level;    ///< a cell is 2^level of the finest cells long
    double width_m;
    std::uint32_t first_weight;
  };
  struct Frame {
    Eigen::Vector2d along, across;
    std::uint32_t key;
  };
  /// One value per bin, in whole groups.
  struct Table {
    std::vector<float> cells_per_m, reach;
    std::vector<float> cell_rows;  // a cell's length, by TexturedGround::rows_of()
    std::vector<std::uint32_t> first_weight, key;
  };
  /// Everything but the rows and tables.
  Scatterers(const Sonar& sonar, double sound_speed_mps, const TexturedGround& ground,
             double reference_heading_rad);
  void add_rows_of_bins(const Sonar& sonar, const std::function<Row(double range_m)>& make);
  void add_tables(const Sonar& sonar, std::uint64_t seed, std::size_t count);
  Row begin_row(double shortest_m, int level, double reach_m) const;
  Row make_plane_row(double shortest_m, double width_m);
  void place_patches(const Frame& frame, const BinLayers& bins, const Table& table,
                     Scratch& scratch) const;
  void place_side_lobes(const BinLayers& bins, const Table& table, Scratch& scratch) const;
  Row make_row(const Sonar& sonar, std::span<const LineArray, 2> arrays, double range_m,
               const std::function<void()>& stop_check);
  double middle_m(std::size_t row) const;

  double cell_m_, turns_per_cell_;
  double nearest_m_;  // ranges below the arrays' length are treated as that length
  TexturedGround ground_;
  bool odd_;  // which of the two sets of directions is used
  std::vector<std::uint16_t> row_of_bin_;
  std::vector<double> width_of_bin_m_;
  std::vector<Row> rows_;
  std::vector<Table> tables_;   // of planes: by twelfths of an octave of 1 / cosine of azimuth
  std::uint32_t columns_ = 0;   // of a row of weights; the last ones are 0
  std::vector<float> weights_;  // real and imaginary parts, by distance from the beam's middle
  std::vector<Frame> frames_;
};

}  // namespace ensonify::engine
