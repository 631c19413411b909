#pragma once

#include <span>
#include <vector>

#include <ensonify/engine/seafloor/face_labels.h>
#include <ensonify/engine/sonar/echo/echo.h>
#include <ensonify/engine/sonar/echo/echo_kernel.h>
#include <ensonify/engine/sonar/echo/range_bins.h>
#include <ensonify/engine/sonar/echo/ray_layout.h>
#include <ensonify/engine/trace/fan_runs.h>
#include <ensonify/engine/trace/ray_fan.h>
#include <ensonify/engine/trace/refraction/refracted_path.h>
#include <ensonify/scatter/backscatter.h>

namespace ensonify::engine {

/// The water between sonar and bed.
struct Medium {
  double sound_speed_mps = 1500.0;
  double absorption_db_per_m = 0.0;
  /// Absorption over depth; null: that everywhere. It must outlive what is made with this.
  const scatter::SoundSpeedProfile* profile = nullptr;
};

/// Turns what the rays of a fan hit into the expected echo of one side of a ping, with the truth
/// beside it.
///
/// A ray of solid angle dOmega that meets the bed at range r and grazing angle g stands for the
/// area r^2 dOmega / sin(g) and returns b_t b_r sigma(g) / r^4 of it, with absorption along the
/// way. (A bent ray spreads to J both on the way out, over the area, and on the way back, where it
/// is J (c_sonar / c_bed)^2: the area cancels the one, and the other stands for r^2. g is where it
/// arrives.) Within a plane of the fan that is a density over elevation. A run of rays on one face
/// is one piece, or a few: its middle's density stands for all the elevation halfway to the
/// neighbouring rays, and its energy lies in the bins between the ranges of its ends. Where one
/// surface goes on from run to run these meet halfway; where it breaks off each keeps its own half
/// step. The bins then go through the pulse.
class EchoFormer {
 public:
  /// The seafloor, the tables and the labels of bodies that move (see FaceLabels) must outlive
  /// this; by_material[i] belongs to a label's sediment i.
  EchoFormer(const Sonar& sonar, const Medium& medium, const Seafloor& seafloor,
             std::span<const scatter::BackscatterTable> by_material,
             const std::vector<Label>* moving = nullptr);

  /// The runs, over these triangles, of a fan that is the aperture's. Fills the line of a side; the
  /// speckled intensity is still the expectation.
  void form(const RayFan& fan, const RayLayout& aperture, const ReceiverMotion& reception,
            refine::Triangles triangles, const FanRuns& runs, EchoLine& line);
  /// The same of rays that did not come straight: hits by ray number, whose t is the range that
  /// their time stands for, and how those came that are asked for.
  void form(const RayFan& fan, const RayLayout& aperture, const ReceiverMotion& reception,
            refine::Triangles triangles, std::span<const Hit> hits, IncidenceSource& arrivals,
            EchoLine& line);

 private:
  static constexpr std::size_t none = static_cast<std::size_t>(-1);
  static constexpr double max_growth = 0.02;  // of a piece's range from end to end

  void begin(const RayFan& fan, const RayLayout& aperture, const ReceiverMotion& reception,
             refine::Triangles triangles, EchoLine& line);
  void begin_plane(std::size_t plane);
  void take_runs(const FanRuns& runs, std::size_t plane);
  void claim_rays(std::span<const Hit> hits, IncidenceSource& arrivals, std::size_t plane);
  void set_piece(std::size_t piece, std::uint32_t begin, std::uint32_t end, std::uint32_t index,
                 std::uint16_t label, double level, double pole, double distance) {
    begin_[piece] = begin;
    end_[piece] = end;
    index_[piece] = index;
    label_[piece] = label;
    level_[piece] = level;
    pole_[piece] = pole;
    distance_[piece] = distance;
    bottom_[piece] = strengths_from_[labels_[label].sediment];
  }
  void shade();
  void absorb();
  void correct();
  void walk(std::size_t plane);
  void finish(EchoLine& line);

  bool answers(std::size_t piece) const { return weight_[piece] >= 0.0f; }
  double first_m(std::size_t piece) const { return range_m_[piece] - to_last_m_[piece]; }
  double last_m(std::size_t piece) const { return range_m_[piece] + to_last_m_[piece]; }
  double half_m(std::size_t piece) const;
  double onward_m(std::size_t piece) const;
  bool continuous(std::size_t a, std::size_t b) const;
  void end_here(std::size_t piece);
  bool end_in_water(std::size_t piece);
  void shade_beyond(std::size_t piece, std::size_t plane);
  double longest_edge_m(std::uint32_t index) const;

  FaceLabels labels_;
  Beam beam_;
  std::span<const scatter::BackscatterTable> by_material_;
  std::vector<float> strengths_;              // of all materials, one after another
  std::vector<std::int32_t> strengths_from_;  // by material
  Eigen::Vector2d lowest_, highest_;          // the seafloor's bounds, seen from above
  double absorption_db_per_m_;                // that the bins' gain has
  const scatter::SoundSpeedProfile* profile_;
  RangeBins bins_;
  std::vector<double> gain_;    // of a bin's energy: source level and absorption
  std::vector<double> pulse_;   // pulse_kernel
  std::vector<double> energy_;  // of the bins, with gain; room for the pulse on either side
  std::vector<double> sums_;    // of the line's bins, through the pulse

  // Of this fan:
  const RayFan* fan_ = nullptr;
  const RayLayout* aperture_ = nullptr;
  const ReceiverMotion* reception_ = nullptr;
  refine::Triangles triangles_;
  Side side_ = Side::port;
  // The pieces of the plane at hand, as PieceKernelArgs has them:
  PieceKernelArgs pass_{};
  std::size_t room_ = 0;
  CacheLines<std::uint32_t> begin_, end_, index_, breaks_;
  CacheLines<std::uint32_t> max_rays_;  // by run, of a piece
  CacheLines<std::uint16_t> label_;
  CacheLines<std::uint8_t> broken_;
  CacheLines<double> level_, pole_, distance_;
  CacheLines<std::int32_t> bottom_;
  CacheLines<double> range_m_, energy_of_, to_last_m_, to_end_m_, middles_, changes_, from_m_,
      until_m_;
  CacheLines<float> weight_, slant_, width_rad_, step_rad_;
  std::vector<RayIncidence> arrivals_;  // of each piece's middle ray, where rays come bent,
  CacheLines<double> sine_;             // and the sine of its grazing angle
};

}  // namespace ensonify::engine
