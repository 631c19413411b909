#include <ensonify/engine/sonar/echo/piece_table.h>

#include <algorithm>

namespace ensonify::engine {

void PieceTable::make_room(std::size_t rays) {
  const std::size_t room = rays + lane_padding;
  if (begin.size() >= room) return;
  const auto resize = [&](auto&... columns) { (columns.resize(room), ...); };
  resize(begin, end, index, label, strengths_from, level, pole, distance);
  resize(answers, range_m, to_last_m, to_end_m, energy);
  resize(beam_weight, aside_m, energy_slope, width_rad, ray_step_rad);
  resize(from_m, until_m, breaks, starts_surface);
  middles.resize(4 * room);
  changes.resize(4 * room);
}

void PieceTable::pad() {
  if (count == 0) return;
  const std::size_t last = count - 1;
  const auto repeat_last = [&](auto&... columns) {
    (std::fill_n(columns.begin() + static_cast<std::ptrdiff_t>(count), lane_padding, columns[last]),
     ...);
  };
  repeat_last(begin, end, index, strengths_from, level, pole, distance);
}

PieceGeometry PieceTable::geometry() const {
  return {.count = count,
          .begin = begin.data(),
          .end = end.data(),
          .index = index.data(),
          .level = level.data(),
          .pole = pole.data(),
          .distance = distance.data(),
          .strengths_from = strengths_from.data()};
}

PieceEchoes PieceTable::echoes() {
  return {.answers = answers.data(),
          .range_m = range_m.data(),
          .to_last_m = to_last_m.data(),
          .to_end_m = to_end_m.data(),
          .energy = energy.data(),
          .middles = middles.data(),
          .changes = changes.data(),
          .beam_weight = beam_weight.data(),
          .aside_m = aside_m.data(),
          .energy_slope = energy_slope.data(),
          .width_rad = width_rad.data(),
          .ray_step_rad = ray_step_rad.data(),
          .from_m = from_m.data(),
          .until_m = until_m.data(),
          .breaks = breaks.data()};
}

PiecesToLay PieceTable::to_lay() {
  return {echoes(), count, 0, label.data(), starts_surface.data()};
}

}  // namespace ensonify::engine
