#include <ensonify/engine/sonar/echo/range_bins.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

#include "support/catch.h"
#include "support/targets.h"

#include <ensonify/engine/sonar/echo/piece_table.h>

using namespace ensonify::engine;

namespace {

constexpr double half_metre_bin = 0.5;
constexpr std::size_t bins = 40;

/// Labels 0 (bed), 1 (instance 7, an object) and 2 (instance 9, a feature of the bed).
Seafloor labelled() {
  Seafloor seafloor;
  seafloor.faces = 1;
  seafloor.labels = {{1, 1, 0}, {2, 3, 7}, {1, 4, 9, false, true}};
  seafloor.face_label = {0};
  return seafloor;
}

struct Laid {
  double from_m, until_m, energy;
  std::uint16_t label = 0;
  bool starts_surface = false;
  float slope = 0.0f;
  bool answers = true;
  float weight = 0.25f;
  double longer = 1.0;          // its range without its neighbours, divided by its range
  double middle_after_m = 0.0;  // how much farther its middle would be
};

/// Pieces of one plane: each 5 m to the east at its middle, 2 m farther east at its end.
PieceTable table_of(const std::vector<Laid>& laid) {
  PieceTable pieces;
  pieces.make_room(100);
  for (const Laid& piece : laid) {
    const std::size_t i = pieces.count;
    pieces.add({.label = piece.label});
    pieces.from_m[i] = piece.from_m;
    pieces.until_m[i] = piece.until_m;
    pieces.range_m[i] = 0.5 * (piece.from_m + piece.until_m) + piece.middle_after_m;
    pieces.to_end_m[i] = 0.5 * (piece.until_m - piece.from_m) * piece.longer;
    pieces.energy[i] = piece.energy;
    pieces.answers[i] = piece.answers;
    pieces.beam_weight[i] = piece.weight;
    pieces.energy_slope[i] = piece.slope;
    pieces.starts_surface[i] = piece.starts_surface;
    pieces.middles[4 * i] = 5.0;
    pieces.changes[4 * i] = 4.0;
  }
  return pieces;
}

class Bins {
 public:
  Bins() {
    bins_.reset();
    line_.bins.assign(bins);
  }
  void plane(const std::vector<Laid>& laid, const std::vector<Shadow>& shadows = {}) {
    bins_.begin_plane();
    bins_.lay(table_of(laid).to_lay());
    for (const Shadow& shadow : shadows) bins_.shade(shadow);
  }
  double energy(std::size_t bin) const { return bins_.energy(bin); }
  double energy() const {
    double sum = 0.0;
    for (std::size_t i = 0; i < bins; ++i) sum += energy(i);
    return sum;
  }
  const EchoLine& line() {
    const Seafloor seafloor = labelled();
    bins_.write(FaceLabels(seafloor), {100.0, 200.0, -3.0}, line_);
    return line_;
  }
  bool is(std::size_t bin, Region region) {
    return line().bins.region[bin] == static_cast<std::uint32_t>(region);
  }

 private:
  RangeBins bins_{half_metre_bin, bins};
  EchoLine line_;
};

}  // namespace

TEST_CASE("a piece's energy lies in the bins between its ends, each its share of the range") {
  const auto [from_m, until_m] = GENERATE(std::pair{4.25, 6.0}, std::pair{6.0, 4.25});
  Bins of;
  of.plane({{from_m, until_m, 7.0}});
  CHECK(of.energy(7) == 0.0);
  CHECK(of.energy(8) == Approx(1.0));  // from 4.25 to 4.5 m: 1/7 of 1.75 m
  for (const std::size_t i : {9u, 10u, 11u}) CHECK(of.energy(i) == Approx(2.0));
  CHECK(std::abs(of.energy(12)) < 1e-12);
  CHECK(of.energy() == Approx(7.0).epsilon(1e-14));
}

TEST_CASE("a piece's slope moves energy towards its last end and keeps the sum") {
  const auto [from_m, until_m] = GENERATE(std::pair{4.0, 5.0}, std::pair{5.0, 4.0});
  Bins of;
  of.plane({{from_m, until_m, 1.0, 0, false, 0.8f}});
  // Density 1 + 0.8 s for s from -1/2 to 1/2: its first half has 0.4, its last 0.6.
  const bool farther = until_m > from_m;
  CHECK(of.energy(farther ? 8 : 9) == Approx(0.4));
  CHECK(of.energy(farther ? 9 : 8) == Approx(0.6));
}

TEST_CASE("a piece that its neighbours shorten is seen at the ranges that are left") {
  // 5 m to the east at its middle, at 9 m; over 12 m of range, 4 m farther east. From 4 to 5 m are
  // left.
  Bins of;
  of.plane({{.from_m = 4.0,
             .until_m = 5.0,
             .energy = 1.0,
             .slope = 0.6f,
             .longer = 12.0,
             .middle_after_m = 4.5}});
  const BinLayers& at = of.line().bins;
  CHECK(at.x_m[8] == Approx(100.0 + 5.0 + 4.0 * (4.25 - 9.0) / 12.0));
  CHECK(at.x_m[9] == Approx(100.0 + 5.0 + 4.0 * (4.75 - 9.0) / 12.0));
  // Nor does its energy change more than over that part.
  CHECK(of.energy(9) - of.energy(8) == Approx(0.25 * 0.6 / 12.0));
  CHECK(of.energy() == Approx(1.0));
}

TEST_CASE("laying conserves energy, however many pieces overlap, on every instruction set") {
  std::vector<Laid> laid;
  double sum = 0.0;
  for (int i = 0; i < 90; ++i) {  // back and forth over the bins, in three labels
    const double from_m = 2.0 + 8.0 * std::sin(0.7 * i) * std::sin(0.7 * i);
    const double until_m = from_m + 4.0 * std::sin(1.3 * i);
    const bool answers = i % 10 != 9;
    laid.push_back({from_m, until_m, 0.1 + 0.01 * i, static_cast<std::uint16_t>(i % 3), i % 4 == 0,
                    0.5f * static_cast<float>(std::cos(i)), answers});
    if (answers) sum += laid.back().energy;
  }
  std::vector<double> first;
  ensonify::tests::on_each_target([&] {
    Bins of;
    of.plane(laid);
    CHECK(of.energy() == Approx(sum).epsilon(1e-12));
    std::vector<double> all;
    for (std::size_t i = 0; i < bins; ++i) all.push_back(of.energy(i));
    for (const float fraction : of.line().bins.fraction) all.push_back(fraction);
    if (first.empty()) first = all;
    CHECK(all == first);
  });
}

TEST_CASE("energy beyond the last bin stays in it, and before the first in that") {
  Bins of;
  of.plane({{19.75, 22.0, 1.0}, {-1.0, 0.25, 1.0}});
  CHECK(of.energy(bins - 1) == Approx(1.0));
  CHECK(of.energy(0) == Approx(1.0));
}

TEST_CASE("pieces that do not answer lay nothing") {
  Bins of;
  of.plane({{4.0, 5.0, 1.0, 0, false, 0.0f, false}});
  CHECK(of.energy() == 0.0);
  CHECK(of.line().first_return == -1);
  CHECK(of.is(8, Region::no_data));
}

TEST_CASE("a bin has the label with the most energy, and its share") {
  Bins of;
  of.plane({{4.0, 4.5, 2.0, 0}, {4.0, 4.5, 3.0, 1, true}, {4.0, 4.5, 1.0, 2, true}});
  of.plane({{4.0, 4.5, 1.0, 0}});
  const BinLayers& out = of.line().bins;
  CHECK(out.instance[8] == 0);  // 3 against 3 and 1: the first
  CHECK(out.fraction[8] == Approx(3.0 / 7.0));
  of.plane({{4.0, 4.5, 0.5, 1}});
  CHECK(of.line().bins.instance[8] == 7);
  CHECK(of.line().bins.class_id[8] == 3);
  CHECK(of.line().bins.fraction[8] == Approx(3.5 / 7.5));
  CHECK(of.is(8, Region::object));
}

TEST_CASE("a feature of the bed has an instance, and is seabed") {
  Bins of;
  of.plane({{4.0, 4.5, 2.0, 2}});
  CHECK(of.line().bins.instance[8] == 9);
  CHECK(of.is(8, Region::seabed));
  CHECK(of.is(7, Region::water_column));
  CHECK(of.line().first_return == 8);
}

TEST_CASE("a bin's place is the mean of what it saw, weighted with energy") {
  Bins of;
  of.plane({{4.0, 5.0, 1.0}});  // its first half 5 m - 4 m / 4 to the east, its last 5 m + 1 m
  CHECK(of.line().bins.x_m[8] == Approx(104.0));
  CHECK(of.line().bins.x_m[9] == Approx(106.0));
  CHECK(of.line().bins.y_m[9] == Approx(200.0));
  of.plane({{4.5, 4.0, 3.0}});  // backwards, wholly in bin 8
  CHECK(of.line().bins.x_m[8] == Approx((0.5 * 104.0 + 3.0 * 105.0) / 3.5));
}

TEST_CASE(
    "places are zero without an echo, and grazing angles stay within 0 and 90 degrees, on every "
    "instruction set") {
  // All but every fifth bin have an echo; their number is no multiple of a register's lanes.
  constexpr std::size_t count = 37;
  std::vector<EchoBin> seen(count);
  for (std::size_t i = 0; i < count; ++i)
    if (i % 5 != 0) {
      const double energy = 0.5 + static_cast<double>(i);
      const double angle_rad = 0.1 * static_cast<double>(i) - 0.5;  // from below 0 to above 90 deg
      seen[i].energy = energy;
      seen[i].seen = {energy * 3.0, energy * -4.0, energy * static_cast<double>(i),
                      energy * angle_rad};
    }
  ensonify::tests::on_each_target([&] {
    std::vector<float> x(count + 1, 7.0f), y = x, z = x, grazing = x;
    write_places(seen.data(), count, {100.0, 200.0, -3.0},
                 {x.data(), y.data(), z.data(), grazing.data()});
    for (std::size_t i = 0; i < count; ++i) {
      const bool lit = i % 5 != 0;
      const double angle_rad = 0.1 * static_cast<double>(i) - 0.5;
      CAPTURE(i);
      CHECK(x[i] == (lit ? Approx(103.0) : Approx(0.0)));
      CHECK(y[i] == (lit ? Approx(196.0) : Approx(0.0)));
      CHECK(z[i] == (lit ? Approx(static_cast<double>(i) - 3.0) : Approx(0.0)));
      CHECK(grazing[i] ==
            (lit ? Approx(std::clamp(angle_rad, 0.0, std::acos(0.0))).margin(1e-7) : Approx(0.0)));
    }
    CHECK(x[count] == 7.0f);  // not written
    CHECK(grazing[count] == 7.0f);
  });
}

TEST_CASE("a shadow covers the bins wholly within it that its plane does not see") {
  Bins of;
  of.plane({{2.0, 4.25, 1.0, 0}, {7.0, 9.0, 1.0, 0, true}}, {{4.25, 7.1, 0.25f, 1}});
  CHECK(of.is(8, Region::seabed));
  for (std::size_t i = 9; i < 14; ++i) {
    CHECK(of.is(i, Region::shadow));
    CHECK(of.line().bins.shadow_fraction[i] == 1.0f);
    CHECK(of.line().bins.shadow_instance[i] == 7);
  }
  CHECK(of.is(14, Region::seabed));
  CHECK(of.line().bins.shadow_fraction[14] == 0.0f);
  CHECK(of.line().bins.shadow_instance[8] == 0);
}

TEST_CASE("bins that a shadow covers in part are not in it, nor those that its plane sees") {
  Bins of;
  of.plane({{2.0, 3.0, 1.0}, {5.1, 5.4, 1.0, 0, true}}, {{4.25, 7.1, 0.25f, 1}});
  for (std::size_t i = 7; i < 16; ++i) {
    CAPTURE(i);
    CHECK(of.is(i, i == 10 ? Region::seabed : i >= 9 && i < 14 ? Region::shadow : Region::no_data));
  }
  CHECK(of.line().bins.shadow_fraction[10] == 0.0f);
}

TEST_CASE("over planes, a shadow is in proportion to their weights, and named for the largest") {
  Bins of;
  of.plane({{2.0, 3.0, 1.0}}, {{3.0, 8.0, 0.3f, 1}, {3.0, 8.0, 0.5f, 0}});  // the first counts
  of.plane({{2.0, 8.0, 1.0, 0, true, 0.0f, true, 0.1f}});
  CHECK(of.line().bins.shadow_fraction[10] == Approx(0.75));
  CHECK(of.line().bins.shadow_instance[10] == 7);
  CHECK(of.is(10, Region::shadow));
  of.plane({{2.0, 8.0, 1.0, 0, true, 0.0f, true, 0.3f}});
  CHECK(of.line().bins.shadow_fraction[10] == Approx(0.3 / 0.7));
  CHECK(of.is(10, Region::seabed));
  of.plane({}, {{3.0, 8.0, 0.4f, 2}});
  CHECK(of.line().bins.shadow_instance[10] == 9);
}

TEST_CASE("bins behind the first return without energy or shadow are starved") {
  Bins of;
  of.plane({{2.0, 2.25, 1.0}, {4.0, 4.25, 1.0, 0, true}});
  CHECK(of.is(5, Region::no_data));
  CHECK(of.line().starved == static_cast<int>(bins) - 4 - 2);
}

TEST_CASE("bins between an object in the water and the bed's first return are water column") {
  Bins of;
  of.plane({{1.0, 1.25, 1.0, 1, true}, {2.0, 2.25, 1.0, 0, true}});
  CHECK(of.is(3, Region::water_column));
  CHECK(of.is(5, Region::no_data));
  CHECK(of.line().first_return == 2);
  CHECK(of.line().starved == static_cast<int>(bins) - 4 - 1);
}

TEST_CASE("two branches of one plane in a bin are layover, except where one turns") {
  Bins turning, layover, two_planes;
  turning.plane({{4.0, 6.2, 1.0}, {6.2, 4.1, 1.0}});  // the profile turns at 6.2 m
  CHECK(turning.line().bins.layover[12] == 0);
  for (std::size_t i = 8; i < 12; ++i) CHECK(turning.line().bins.layover[i] == 1);
  layover.plane({{4.0, 6.0, 1.0}, {4.6, 5.4, 1.0, 0, true}});
  for (const std::size_t i : {9u, 10u}) CHECK(layover.line().bins.layover[i] == 1);
  CHECK(layover.line().bins.layover[11] == 0);
  two_planes.plane({{4.0, 6.0, 1.0}});
  two_planes.plane({{4.0, 6.0, 1.0}});
  for (std::size_t i = 0; i < bins; ++i) CHECK(two_planes.line().bins.layover[i] == 0);
}
