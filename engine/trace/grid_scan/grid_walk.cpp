// Compiled once per Highway target (vector_targets.h).

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "ensonify/engine/trace/grid_scan/grid_walk.cpp"
#include <ensonify/engine/simd/vector_targets.h>

#include <hwy/foreach_target.h>

#include <hwy/highway.h>

#include <ensonify/engine/simd/gather-inl.h>
#include <ensonify/engine/trace/fan_frame-inl.h>
#include <ensonify/engine/trace/fan_scan/crossings-inl.h>
#include <ensonify/engine/trace/grid_scan/grid_walk.h>

HWY_BEFORE_NAMESPACE();
namespace ensonify::engine {
namespace HWY_NAMESPACE {
namespace {

static_assert(lanes <= static_cast<std::int64_t>(GridWalks::most));

using VI = hn::Vec<I>;
using HalfI = hn::Rebind<std::int32_t, D>;
constexpr HalfI half;

constexpr std::int64_t chunk_steps = 32;  // even
// A walk takes at least two steps per column, or per row where it crosses more of these.
constexpr std::int64_t chunk_cells = chunk_steps / 2;

// Tiles follow one another, each with the rows of bits at its start.
constexpr std::int64_t tile_words = sizeof(refine::HeightGrid::Tile) / 8,
                       tile_floats = 2 * tile_words;
static_assert(tile_words == 5 << 9 && tile_floats == 5 << 10);
static_assert(refine::HeightGrid::tile_cells == 64);
constexpr std::int64_t tile_points = refine::HeightGrid::tile_points;

HWY_INLINE VI load(const std::int64_t* from) { return hn::Load(di, from); }
HWY_INLINE M mask_of(VI word) { return hn::RebindMask(d, hn::MaskFromVec(word)); }
HWY_INLINE VI word_of(M mask) { return hn::BitCast(di, hn::VecFromMask(d, mask)); }
HWY_INLINE VI choose(M mask, VI yes, VI no) {
  return hn::IfThenElse(hn::RebindMask(di, mask), yes, no);
}

// The product a b, for numbers of fewer than 32 bits.
HWY_INLINE VI times(VI a, std::int64_t b) {
#if HWY_TARGET == HWY_SCALAR
  return hn::Set(di, hn::GetLane(a) * b);
#else
  constexpr hn::RepartitionToNarrow<I> narrow;
  return hn::MulEven(hn::BitCast(narrow, a), hn::Set(narrow, static_cast<std::int32_t>(b)));
#endif
}

HWY_INLINE V gather(const float* from, VI index) {
  return hn::PromoteTo(d, gather(df, from, index));
}

HWY_INLINE Pair<V> gather_pair(const float* from, VI index) {
  constexpr hn::RebindToUnsigned<HalfI> u;
  const auto both = gather(du, from, index);
  const auto number = [&](hn::Vec<U> bits) HWY_ATTR {
    return hn::PromoteTo(d, hn::BitCast(df, hn::TruncateTo(u, bits)));
  };
  return {number(both), number(hn::ShiftRight<32>(both))};
}

// Where a point's height is, given the tile of a cell that it is a corner of.
struct TilePlace {
  VI column, row, number;
};
HWY_INLINE TilePlace tile_of(const GridArrays& grid, VI column, VI row) {
  const VI c = hn::ShiftRight<6>(column), r = hn::ShiftRight<6>(row);
  return {c, r, times(r, grid.tiles_across) + c};
}
HWY_INLINE VI place_of(const TilePlace& tile, VI column, VI row) {
  const VI c = column - hn::ShiftLeft<6>(tile.column), r = row - hn::ShiftLeft<6>(tile.row);
  const VI first = hn::ShiftLeft<12>(tile.number) + hn::ShiftLeft<10>(tile.number);
  return first + hn::ShiftLeft<6>(r) + r + c;
}
HWY_INLINE V3 point_of(const GridArrays& grid, const TilePlace& tile, VI column, VI row) {
  return {gather(grid.x, column), gather(grid.y, row), gather(grid.z, place_of(tile, column, row))};
}

// Positions of moved points from the fan's origin; NaN for a point that is not among them.
HWY_INLINE V3 moved_point(const MovedPoints& moved, VI column, VI row) {
  constexpr hn::RebindToUnsigned<HalfI> u;
  const auto columns = hn::BitCast(di, hn::GatherIndex(du, moved.columns, row));
  const VI first = hn::And(columns, hn::Set(di, 0xffffffff)), end = hn::ShiftRight<32>(columns);
  const auto there = hn::AndNot(hn::Lt(column, first), hn::Lt(column, end));
  const auto narrow = hn::BitCast(half, hn::TruncateTo(u, hn::BitCast(du, row)));
  const VI column_0 = hn::PromoteTo(di, hn::GatherIndex(half, moved.column_0, narrow));
  const VI place = hn::ShiftLeft<2>(hn::IfThenElseZero(there, column_0 + column));
  const M known = hn::RebindMask(d, there);
  const V none = hn::NaN(d);
  return {hn::IfThenElse(known, gather(moved.positions, place), none),
          hn::IfThenElse(known, gather(moved.positions + 1, place), none),
          hn::IfThenElse(known, gather(moved.positions + 2, place), none)};
}
// A point of the grid in the frame of the fan.
HWY_INLINE V3 point_in(const Frame& frame, const GridArrays& grid, const TilePlace& tile, VI column,
                       VI row) {
  if (!grid.moved) return into(frame, point_of(grid, tile, column, row));
  const V3 from = moved_point(*grid.moved, column, row);
  return {dot(frame.array, from), dot(frame.middle, from), dot(frame.pole, from)};
}

HWY_INLINE void store_ends(const InPlane& left, const InPlane& right, GridWalks& at) {
  hn::Store(left.off, d, &at.left_off[0]);
  hn::Store(left.x, d, &at.left_x[0]);
  hn::Store(left.y, d, &at.left_y[0]);
  hn::Store(right.off, d, &at.right_off[0]);
  hn::Store(right.x, d, &at.right_x[0]);
  hn::Store(right.y, d, &at.right_y[0]);
}

HWY_INLINE Frame frame_of(const GridWalks& at) {
  const auto vector = [](const GridWalks::Lanes<double>* axes) HWY_ATTR {
    return V3{hn::Load(d, axes[0].data()), hn::Load(d, axes[1].data()),
              hn::Load(d, axes[2].data())};
  };
  const auto* axes = &at.axes[0];
  return {vector(&at.origin[0]), vector(axes), vector(axes + 3), vector(axes + 6)};
}

// The orders of the rays of each walk's fan.
struct OrderOfWalks {
  const GridWalkArgs& args;
  const GridWalks& walks;

  HWY_INLINE V first_q() const { return hn::Load(d, &walks.first_q[0]); }
  HWY_INLINE V steps_per_q() const { return hn::Load(d, &walks.steps_per_q[0]); }
  HWY_INLINE V last_step() const { return hn::Load(d, &walks.last_step[0]); }
  HWY_INLINE hn::Vec<U> line(VI step) const {
    return gather(du, args.lines, load(&walks.lines[0]) + step);
  }
  HWY_INLINE V before(VI ray) const {
    return gather(d, args.ascending, load(&walks.ascending[0]) + ray);
  }
  HWY_INLINE V at(VI ray) const {
    return gather(d, args.ascending + 1, load(&walks.ascending[0]) + ray);
  }
};

// Takes one step of each walk: through the face ahead of the present edge, to the edge where the
// plane leaves it.
HWY_INLINE void step(const GridArrays& grid, GridWalks& at, double* x, double* y,
                     std::uint64_t* faces) {
  const VI zero = hn::Zero(di), one = hn::Set(di, 1);
  const VI lc = load(&at.left_column[0]), lr = load(&at.left_row[0]);
  const VI rc = load(&at.right_column[0]), rr = load(&at.right_row[0]);
  // Forward is to the right of the way from the right end to the left one.
  const VI across_c = lc - rc, across_r = lr - rr;
  const VI forward_c = across_r, forward_r = zero - across_c;
  const auto diagonal = hn::And(hn::Ne(across_c, zero), hn::Ne(across_r, zero));
  const VI cell_c = hn::Min(lc, rc) + hn::IfThenZeroElse(diagonal, hn::Min(forward_c, zero));
  const VI cell_r = hn::Min(lr, rr) + hn::IfThenZeroElse(diagonal, hn::Min(forward_r, zero));
  const VI before = hn::Set(di, -1);
  const auto inside =
      hn::And(hn::And(hn::Gt(cell_c, before), hn::Lt(cell_c, hn::Set(di, grid.cells_across))),
              hn::And(hn::Gt(cell_r, before), hn::Lt(cell_r, hn::Set(di, grid.cells_up))));
  M active = mask_of(load(&at.active[0]));
  const M leaves = hn::AndNot(hn::RebindMask(d, inside), active);
  hn::Store(hn::Or(load(&at.left_grid[0]), word_of(leaves)), di, &at.left_grid[0]);
  active = hn::AndNot(leaves, active);
  const VI c = choose(active, cell_c, zero), r = choose(active, cell_r, zero);

  const TilePlace tile = tile_of(grid, c, r);
  const VI word =
      hn::ShiftLeft<11>(tile.number) + hn::ShiftLeft<9>(tile.number) + hn::And(r, hn::Set(di, 63));
  const auto bits = gather(du, grid.rising, word);
  const auto shift = hn::BitCast(du, hn::And(c, hn::Set(di, 63)));
  const VI rising = hn::And(hn::BitCast(di, hn::Shr(bits, shift)), one);
  const auto rises = hn::Ne(rising, zero);
  // The third corner. From a side of the cell: opposite that end which is not on the diagonal.
  const auto opposite_left = hn::Eq(hn::And(lc + lr + c + r, one), rising);
  const VI side_c = hn::IfThenElse(opposite_left, lc, rc) + forward_c;
  const VI side_r = hn::IfThenElse(opposite_left, lr, rr) + forward_r;
  VI ac = hn::IfThenElse(diagonal, hn::IfThenElse(rises, lc, rc), side_c);
  VI ar = hn::IfThenElse(diagonal, hn::IfThenElse(rises, rr, lr), side_r);
  ac = choose(active, ac, zero), ar = choose(active, ar, zero);

  const V3 apex = point_in(frame_of(at), grid, tile, ac, ar);
  const V sine = hn::Load(d, &at.sin_azimuth[0]), cosine = hn::Load(d, &at.cos_azimuth[0]);
  const InPlane in{off_plane(sine, cosine, apex.x, apex.y),
                   along_plane(sine, cosine, apex.x, apex.y), apex.z};
  const V apex_2 = dot(apex, apex);
  if (grid.moved) {
    const M lost = hn::And(active, hn::IsNaN(apex_2));
    hn::Store(hn::Or(load(&at.doubtful[0]), word_of(lost)), di, &at.doubtful[0]);
    active = hn::AndNot(lost, active);
  }
  const M positive = hn::Ge(in.off, hn::Zero(d));
  const M to_right = hn::Xor(positive, mask_of(load(&at.positive_left[0])));
  const M new_left = hn::AndNot(to_right, active), new_right = hn::And(to_right, active);

  InPlane left{hn::Load(d, &at.left_off[0]), hn::Load(d, &at.left_x[0]),
               hn::Load(d, &at.left_y[0])};
  InPlane right{hn::Load(d, &at.right_off[0]), hn::Load(d, &at.right_x[0]),
                hn::Load(d, &at.right_y[0])};
  const V left_2 = hn::Load(d, &at.left_2[0]), right_2 = hn::Load(d, &at.right_2[0]);
  const V farthest = hn::Max(apex_2, hn::Max(left_2, right_2));
  const M far = hn::Gt(farthest, hn::Load(d, &at.range_m2[0]));
  const VI second = lr + rr + ar - (r + hn::ShiftLeft<1>(r)) - one;
  const VI face = second + hn::ShiftLeft<GridFace::rising>(rising) +
                  hn::And(word_of(far), hn::Set(di, 1 << GridFace::far)) +
                  hn::ShiftLeft<GridFace::column>(c) + hn::ShiftLeft<GridFace::row>(r);
  hn::Store(hn::BitCast(du, face), du, faces);

  left = choose(new_left, in, left), right = choose(new_right, in, right);
  const Crossing crossing = between(left, right);
  hn::Store(crossing.x, d, x);
  hn::Store(crossing.y, d, y);

  hn::Store(choose(new_left, ac, lc), di, &at.left_column[0]);
  hn::Store(choose(new_left, ar, lr), di, &at.left_row[0]);
  hn::Store(choose(new_right, ac, rc), di, &at.right_column[0]);
  hn::Store(choose(new_right, ar, rr), di, &at.right_row[0]);
  store_ends(left, right, at);
  hn::Store(hn::IfThenElse(new_left, apex_2, left_2), d, &at.left_2[0]);
  hn::Store(hn::IfThenElse(new_right, apex_2, right_2), d, &at.right_2[0]);

  const V ahead_x = hn::Load(d, &at.ahead_x[0]), ahead_y = hn::Load(d, &at.ahead_y[0]);
  const V nearest =
      hn::Min(fma(left.x, ahead_x, left.y * ahead_y), fma(right.x, ahead_x, right.y * ahead_y));
  const M beyond = hn::Gt(nearest, hn::Load(d, &at.reach_m[0]));
  hn::Store(word_of(hn::AndNot(beyond, active)), di, &at.active[0]);
}

// Where in GridArrays::z the walks are likely to be in the next chunk but one, by cell and lane:
// for the steps to fetch before they are needed.
HWY_INLINE void look_ahead(const GridArrays& grid, const GridWalks& at, std::int64_t* places) {
  const V column = hn::ConvertTo(d, hn::Min(load(&at.left_column[0]), load(&at.right_column[0])));
  const V row = hn::ConvertTo(d, hn::Min(load(&at.left_row[0]), load(&at.right_row[0])));
  const auto cell = [&](V from, V per_cell, std::int64_t ahead, std::int64_t count) HWY_ATTR {
    const V there = fma(hn::Set(d, static_cast<double>(ahead)), per_cell, from);
    return hn::Max(hn::Zero(di), hn::Min(hn::ConvertTo(di, there), hn::Set(di, count - 1)));
  };
  for (std::int64_t i = 0; i < chunk_cells; ++i) {
    const VI c =
        cell(column, hn::Load(d, &at.columns_ahead[0]), chunk_cells + i, grid.cells_across);
    const VI r = cell(row, hn::Load(d, &at.rows_ahead[0]), chunk_cells + i, grid.cells_up);
    hn::Store(place_of(tile_of(grid, c, r), c, r), di, places + i * lanes);
  }
}

// Computes the present edge of walks that begin.
HWY_INLINE void begin(const GridWalkArgs& args, GridWalks& at) {
  const GridArrays& grid = args.grid;
  const Frame frame = frame_of(at);
  const V sine = hn::Load(d, &at.sin_azimuth[0]), cosine = hn::Load(d, &at.cos_azimuth[0]);
  V distance_2;
  const auto end_at = [&](const std::int64_t* column, const std::int64_t* row) HWY_ATTR {
    const VI c = load(column), r = load(row);
    const TilePlace tile = tile_of(grid, hn::Min(c, hn::Set(di, grid.cells_across - 1)),
                                   hn::Min(r, hn::Set(di, grid.cells_up - 1)));
    const V3 p = point_in(frame, grid, tile, c, r);
    distance_2 = dot(p, p);
    return InPlane{off_plane(sine, cosine, p.x, p.y), along_plane(sine, cosine, p.x, p.y), p.z};
  };
  const InPlane left = end_at(&at.left_column[0], &at.left_row[0]);
  hn::Store(distance_2, d, &at.left_2[0]);
  const InPlane right = end_at(&at.right_column[0], &at.right_row[0]);
  hn::Store(distance_2, d, &at.right_2[0]);
  store_ends(left, right, at);
  const Crossing crossing = between(left, right);
  hn::Store(crossing.x, d, &at.x[0]);
  hn::Store(crossing.y, d, &at.y[0]);
  const M in_front = hn::Gt(crossing.x, hn::Zero(d));
  const V order = order_of(in_front, crossing);
  VI below, same;
  find_below(OrderOfWalks{args, at}, order, order, below, same);
  hn::Store(choose(in_front, below, hn::Zero(di)), di, &at.below[0]);
}

// A crossing on its plane, and the rays below it.
struct Front {
  V x, y;
  VI below;
  M is;
};

// Marks walks where this ray is close to the crossing.
HWY_INLINE void mark_doubt(const GridWalkArgs& args, GridWalks& at, M where, const Front& crossing,
                           VI ray) {
  const VI last = load(&at.elevations[0]) - hn::Set(di, 1);
  const V order = OrderOfWalks{args, at}.at(hn::Max(hn::Zero(di), hn::Min(ray, last)));
  const V gap = hn::Abs(crossing.y - order * (crossing.x + hn::Abs(crossing.y)));
  const M close = hn::And(hn::And(crossing.is, where), hn::Le(gap, hn::Load(d, &at.doubt_m2[0])));
  hn::Store(hn::Or(load(&at.doubtful[0]), word_of(close)), di, &at.doubtful[0]);
}

// Stores the rays that see the faces between the crossings p and q, and hides these rays from later
// faces.
HWY_INLINE void hide(const GridWalkArgs& args, GridWalks& at, const Front& p, const Front& q,
                     std::uint64_t* interval) {
  const VI zero = hn::Zero(di);
  VI p_rays = p.below, q_rays = q.below;
  if (HWY_UNLIKELY(!hn::AllTrue(d, hn::And(p.is, q.is)))) {
    // There are no rays behind the pole: see find_intervals() of fan_scan. Faces behind it hide no
    // ray: they are where the walk begins.
    const VI all = load(&at.elevations[0]);
    const V turn = p.x * q.y - p.y * q.x;
    const M up = hn::Gt(turn, hn::Zero(d)), down = hn::Lt(turn, hn::Zero(d));
    const M behind = hn::Not(hn::Or(p.is, q.is));
    const VI first = choose(mask_of(load(&at.outwards[0])), zero, all);
    const VI p_end = choose(behind, first, choose(hn::And(q.is, down), all, zero));
    const VI q_end = choose(behind, first, choose(hn::And(p.is, up), all, zero));
    p_rays = choose(p.is, p_rays, p_end), q_rays = choose(q.is, q_rays, q_end);
  }
  const VI lower = hn::Min(p_rays, q_rays), upper = hn::Max(p_rays, q_rays);
  const VI from = load(&at.from[0]), until = load(&at.until[0]);
  const VI begin = hn::Max(lower, from), end = hn::Min(upper, until);
  hn::Store(hn::BitCast(du, begin + hn::ShiftLeft<32>(end)), du, interval);
  const M outwards = mask_of(load(&at.outwards[0]));
  const VI now_from = choose(outwards, hn::Max(upper, from), from);
  const VI now_until = choose(outwards, until, hn::Min(lower, until));
  hn::Store(now_from, di, &at.from[0]);
  hn::Store(now_until, di, &at.until[0]);
  const VI one = hn::Set(di, 1);
  // If the face after p turns away from the sonar, p is a crest, and the ray next to p may pass the
  // crest within rounding.
  const VI back = choose(outwards, p_rays - q_rays, q_rays - p_rays);
  const VI seen = choose(outwards, p_rays - from, until - p_rays);
  const auto turns_away = hn::AndNot(hn::Lt(seen, zero), hn::Gt(back, zero));
  if (!hn::AllFalse(di, turns_away))
    mark_doubt(args, at, hn::RebindMask(d, turns_away), p, choose(outwards, p_rays - one, p_rays));
  // After the last ray the walk may end, so whether the next face turns away is not known.
  const auto ends = hn::AndNot(hn::Lt(now_from, now_until), hn::Lt(from, until));
  if (HWY_UNLIKELY(!hn::AllFalse(di, ends)))
    mark_doubt(args, at, hn::RebindMask(d, ends), q, choose(outwards, until - one, from));
}

HWY_INLINE void find_rays(const GridWalkArgs& args, GridWalks& at, const double* x, const double* y,
                          std::uint64_t* intervals) {
  const V zero = hn::Zero(d);
  Front before{hn::Load(d, &at.x[0]), hn::Load(d, &at.y[0]), load(&at.below[0]), {}};
  before.is = hn::Gt(before.x, zero);
  for (std::int64_t i = 0; i < chunk_steps * lanes; i += 2 * lanes) {
    Front p{hn::Load(d, x + i), hn::Load(d, y + i), {}, {}};
    Front q{hn::Load(d, x + i + lanes), hn::Load(d, y + i + lanes), {}, {}};
    p.is = hn::Gt(p.x, zero), q.is = hn::Gt(q.x, zero);
    find_below(OrderOfWalks{args, at}, order_of(p.is, {p.x, p.y}), order_of(q.is, {q.x, q.y}),
               p.below, q.below);
    hide(args, at, before, p, intervals + i);
    hide(args, at, p, q, intervals + i + lanes);
    before = q;
  }
  hn::Store(before.x, d, &at.x[0]);
  hn::Store(before.y, d, &at.y[0]);
  hn::Store(before.below, di, &at.below[0]);
  const M hidden = hn::Not(hn::RebindMask(d, hn::Lt(load(&at.from[0]), load(&at.until[0]))));
  hn::Store(word_of(hn::AndNot(hidden, mask_of(load(&at.active[0])))), di, &at.active[0]);
}

// The corners of a cell's face: HeightGrid::rising_faces and falling_faces.
HWY_INLINE Corners corners_of(M second, M rising, V3 south_west, V3 south_east, V3 north_west,
                              V3 north_east) {
  return {choose(hn::AndNot(rising, second), south_east, south_west),
          choose(second, north_east, south_east),
          choose(hn::AndNot(second, rising), north_east, north_west)};
}
HWY_INLINE Corners moved_corners(const MovedPoints& moved, M second, M rising, VI column, VI row) {
  const VI one = hn::Set(di, 1);
  return corners_of(second, rising, moved_point(moved, column, row),
                    moved_point(moved, column + one, row), moved_point(moved, column, row + one),
                    moved_point(moved, column + one, row + one));
}

}  // namespace

void walk_grid(const GridWalkArgs& args) {
  for (std::int64_t group = 0; group < args.groups; ++group) begin(args, args.walks[group]);
  constexpr std::int64_t room = chunk_steps * GridWalks::most, together = 3;
  alignas(64) double x[together][room], y[together][room];
  alignas(64) std::uint64_t faces[together][room], intervals[room];
  alignas(64) std::int64_t later[together][chunk_cells * GridWalks::most];
  // Interleave groups: a step depends on the step before it, so the processor works on another
  // group meanwhile. A group that ends makes way for the next one.
  std::int64_t going[together], count = 0, next = 0;
  for (;;) {
    while (count < together && next < args.groups) going[count++] = next++;
    if (count == 0) return;
    for (std::int64_t k = 0; k < count; ++k) look_ahead(args.grid, args.walks[going[k]], later[k]);
    for (std::int64_t step_number = 0; step_number < chunk_steps; ++step_number)
      for (std::int64_t k = 0; k < count; ++k) {
        // A cell's southern points, then its northern ones.
        const std::int64_t* const places = later[k] + step_number / 2 * lanes;
        const std::int64_t north = step_number % 2 * tile_points;
        for (std::int64_t lane = 0; lane < lanes; ++lane)
          __builtin_prefetch(args.grid.z + places[lane] + north);
        const std::int64_t i = step_number * lanes;
        step(args.grid, args.walks[going[k]], x[k] + i, y[k] + i, faces[k] + i);
      }
    std::int64_t still_going = 0;
    for (std::int64_t k = 0; k < count; ++k) {
      const std::int64_t group = going[k];
      GridWalks& at = args.walks[group];
      find_rays(args, at, x[k], y[k], intervals);
      for (std::int64_t lane = 0; lane < lanes; ++lane) {
        const std::int64_t walk = group * lanes + lane;
        std::uint64_t* const to = args.intervals + walk * args.room;
        std::uint64_t* const faces_of_walk = args.faces + walk * args.room;
        std::int64_t found = at.count[static_cast<std::size_t>(lane)];
        for (std::int64_t i = lane; i < chunk_steps * lanes; i += lanes) {
          to[found] = intervals[i];
          faces_of_walk[found] = faces[k][i];
          found += (intervals[i] & 0xffffffff) < intervals[i] >> 32;
        }
        at.count[static_cast<std::size_t>(lane)] = found;
      }
      if (!hn::AllFalse(d, mask_of(load(&at.active[0])))) going[still_going++] = group;
    }
    count = still_going;
  }
}

std::int64_t walks_together() { return lanes; }

void lay_runs(GridRunArgs& args, const FoundFaces& found, std::int64_t from, std::int64_t until) {
  const GridArrays& grid = args.grid;
  const Frame frame = laid(args.frame);
  const V sine = hn::Set(d, args.sin_azimuth), cosine = hn::Set(d, args.cos_azimuth);
  const VI zero = hn::Zero(di);
  constexpr hn::RebindToUnsigned<HalfI> narrow;
  for (std::int64_t i = 0; i < found.count; i += lanes) {
    const std::int64_t run = args.run + i, first_row = args.row + i;
    const auto store = [&](VI numbers, std::uint32_t* to) HWY_ATTR {
      hn::StoreU(hn::TruncateTo(narrow, hn::BitCast(du, numbers)), narrow, to);
    };
    const VI interval = hn::BitCast(di, hn::LoadU(du, found.intervals + i));
    const VI begin = hn::And(interval, hn::Set(di, 0xffffffff)), end = hn::ShiftRight<32>(interval);
    store(hn::Max(begin, hn::Set(di, from)), args.begin + run);
    store(hn::Min(end, hn::Set(di, until)), args.end + run);
    store(hn::Iota(di, 0) + hn::Set(di, first_row), args.index + run);

    const auto within = hn::FirstN(di, static_cast<std::size_t>(found.count - i));
    const VI face = hn::IfThenElseZero(within, hn::BitCast(di, hn::LoadU(du, found.faces + i)));
    const auto has = [&](int bit) HWY_ATTR {
      return hn::Ne(hn::And(face, hn::Set(di, std::int64_t{1} << bit)), zero);
    };
    const VI row = hn::BitCast(di, hn::ShiftRight<GridFace::row>(hn::BitCast(du, face)));
    const VI column = hn::ShiftRight<GridFace::column>(hn::And(face, hn::Set(di, 0xffffffff)));
    static_assert(GridFace::second == 0);
    const VI number =
        hn::ShiftLeft<1>(times(row, grid.cells_across) + column) + hn::And(face, hn::Set(di, 1));
    store(number, args.face + run);
    store(number, args.numbers + first_row);
    const auto far = has(GridFace::far);
    if (HWY_UNLIKELY(!hn::AllFalse(di, far))) {
      const unsigned bits = bits_of(di, far);
      for (std::int64_t k = 0; k < lanes; ++k)
        if (bits >> k & 1) args.far[args.far_count++] = static_cast<std::uint32_t>(run + k);
    }

    const TilePlace tile = tile_of(grid, column, row);
    const Pair<V> x = gather_pair(grid.x, column), y = gather_pair(grid.y, row);
    const VI place = place_of(tile, column, row);
    const Pair<V> south = gather_pair(grid.z, place);
    const Pair<V> north = gather_pair(grid.z, place + hn::Set(di, tile_points));
    const M second = hn::RebindMask(d, has(GridFace::second)),
            rising = hn::RebindMask(d, has(GridFace::rising));
    const Corners at =
        corners_of(second, rising, {x.at, y.at, south.at}, {x.next, y.at, south.next},
                   {x.at, y.next, north.at}, {x.next, y.next, north.next});
    float* to = args.positions + 3 * first_row;
    for (const V3& p : {at.a, at.b, at.c}) {
      hn::StoreInterleaved3(hn::DemoteTo(df, p.x), hn::DemoteTo(df, p.y), hn::DemoteTo(df, p.z), df,
                            to);
      to += 3 * args.rows;
    }
    const FacePlane plane =
        face_plane(frame, args.frame.handedness,
                   grid.moved ? moved_corners(*grid.moved, second, rising, column, row) : at);
    store_cut(plane, sine, cosine, args.level + run, args.pole + run, args.distance + run);
  }
  args.run += found.count;
  args.row += found.count;
}

}  // namespace HWY_NAMESPACE
}  // namespace ensonify::engine
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace ensonify::engine {

HWY_EXPORT(walk_grid);
HWY_EXPORT(walks_together);
HWY_EXPORT(lay_runs);

void walk_grid(const GridWalkArgs& args) { HWY_DYNAMIC_DISPATCH(walk_grid)(args); }

std::int64_t walks_together() { return HWY_DYNAMIC_DISPATCH(walks_together)(); }

void lay_runs(GridRunArgs& args, const FoundFaces& found, std::int64_t from, std::int64_t until) {
  HWY_DYNAMIC_DISPATCH(lay_runs)(args, found, from, until);
}

}  // namespace ensonify::engine
#endif
