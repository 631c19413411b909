#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include <ensonify/engine/sonar/echo/echo_kernel.h>

namespace ensonify::engine {

// The inner loops that lay pieces into range bins; echo_kernel.h has the loops that compute pieces.

/// A range bin while planes are laid into it.
struct alignas(64) EchoBin {  // one cache line
  static constexpr int branch_bits = 16;
  static constexpr std::int32_t no_label = -1;

  std::array<double, 4> seen{};  ///< PieceEchoes::middles times energy
  double energy = 0.0;
  float lit = 0.0f;         ///< sum of the beam weights of the planes that see the bin
  float shadowed = 0.0f;    ///< sum of the beam weights of the planes for which it is in shadow
  float max_shadow = 0.0f;  ///< the largest of these beam weights
  std::uint32_t visit = 0;  ///< the last plane laid here, and the number of the branch there
  std::int32_t label = no_label;   ///< of the first piece that was laid here
  std::uint16_t shadow_label = 0;  ///< of what casts the shadow with max_shadow
  std::uint16_t shadow_plane = 0;  ///< the last plane for which it is in shadow
};

/// What a bin received from past nadir, that is, from the other side of the track: the energy,
/// which is part of EchoBin::energy, and the places like EchoBin::seen, which has only the rest.
struct alignas(64) PastNadir {
  std::array<double, 4> seen{};
  double energy = 0.0;
};

/// Energy in a bin with another label than the bin's first.
struct OtherShare {
  double energy;
  std::uint32_t bin;
  std::uint16_t label;
};

/// The bins that pieces are laid into, and the state of laying. A branch is a part of a plane's
/// pieces over which the range only grows, or only falls, and whose surface does not break.
struct EchoBins {
  EchoBin* bins;
  PastNadir* past;        ///< per bin
  std::size_t past_end;   ///< bins from here on got nothing from past nadir
  std::uint8_t* layover;  ///< per bin: 1 where two branches of one plane meet
  std::size_t count;
  double bin_m;
  std::uint32_t visit;  ///< plane << EchoBin::branch_bits | branch
  bool farther;         ///< the range grows over this branch
  std::size_t turning;  ///< the bin where this branch began, if the branch before ended there
  std::size_t end;      ///< the bin where the piece before ended
  OtherShare* others;
  std::size_t other_count, other_room;
};

/// The pieces that are laid into bins: columns as in PieceEchoes, with the padding of
/// PieceGeometry.
struct PiecesToLay : PieceEchoes {
  std::size_t count;
  /// The number of pieces, from the first on, that lie past nadir. They count as another plane. If
  /// a side receives the bed on both sides of nadir, this is no layover. A shadow on the bed of its
  /// own side still counts as a shadow.
  std::size_t past;
  const std::uint16_t* label;
  const std::uint8_t* starts_surface;  ///< 1: does not continue the surface of the piece before it
};

/// Lays the pieces from number `first` on, each between its two ranges. Returns the number of the
/// first piece that was not laid because `others` may have no room for its shares, or the count.
std::size_t lay_pieces(const PiecesToLay& pieces, std::size_t first, EchoBins& bins);

/// Writes the energy-weighted place of the echo in each of the first bins, in metres, and its
/// grazing angle: `to` are the layers x_m, y_m, z_m and grazing_rad. Bins without energy get zeros.
/// `origin` is the origin of the pieces' places.
void write_places(const EchoBin* bins, std::size_t count, const std::array<double, 3>& origin,
                  const std::array<float*, 4>& to);

}  // namespace ensonify::engine
