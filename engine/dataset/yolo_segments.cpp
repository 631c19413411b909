#include <ensonify/engine/dataset/yolo_segments.h>

#include <iterator>
#include <map>

#include <fmt/format.h>

namespace ensonify::engine {
namespace {

/// By corner: the ends of the edges that begin there; two where pixels touch in a corner only.
using Edges = std::map<Corner, std::vector<Corner>>;

/// The border edges of a set of pixels, with the set on their right. has(c, r): is a pixel in it?
Edges edges_of(std::size_t columns, std::size_t rows, const auto& has) {
  Edges edges;
  for (int row = 0; row < static_cast<int>(rows); ++row)
    for (int column = 0; column < static_cast<int>(columns); ++column) {
      if (!has(column, row)) continue;
      const Corner a{column, row}, b{column + 1, row}, c{column + 1, row + 1}, d{column, row + 1};
      if (!has(column, row - 1)) edges[a].push_back(b);
      if (!has(column + 1, row)) edges[b].push_back(c);
      if (!has(column, row + 1)) edges[c].push_back(d);
      if (!has(column - 1, row)) edges[d].push_back(a);
    }
  return edges;
}

bool in_line(const Corner& a, const Corner& b, const Corner& c) {
  return (a[0] == b[0] && b[0] == c[0]) || (a[1] == b[1] && b[1] == c[1]);
}

}  // namespace

std::vector<std::vector<Corner>> loops_of(std::span<const std::size_t> runs, std::size_t rows) {
  std::vector<bool> inside;  // column by column
  bool set = false;
  for (const std::size_t run : runs) {
    inside.insert(inside.end(), run, set);
    set = !set;
  }
  const std::size_t columns = inside.size() / rows;
  Edges edges = edges_of(columns, rows, [&](int column, int row) {
    return column >= 0 && row >= 0 && column < static_cast<int>(columns) &&
           row < static_cast<int>(rows) &&
           inside[static_cast<std::size_t>(column) * rows + static_cast<std::size_t>(row)];
  });
  std::vector<std::vector<Corner>> loops;
  while (!edges.empty()) {
    std::vector<Corner> loop;
    const Corner first = edges.begin()->first;
    Corner at = first;
    do {
      const auto leaving = edges.find(at);
      const Corner next = leaving->second.back();
      leaving->second.pop_back();
      if (leaving->second.empty()) edges.erase(leaving);
      if (loop.size() > 1 && in_line(loop[loop.size() - 2], loop.back(), at)) loop.pop_back();
      loop.push_back(at);
      at = next;
    } while (at != first);
    loops.push_back(std::move(loop));
  }
  return loops;
}

std::string yolo_segment(std::size_t class_number, std::span<const std::vector<Corner>> loops,
                         std::size_t columns, std::size_t rows) {
  if (loops.empty()) return "";
  std::string text = fmt::format("{}", class_number);
  const auto out = std::back_inserter(text);
  const auto add = [&](const Corner& corner) {
    fmt::format_to(out, " {:.6f} {:.6f}", static_cast<double>(corner[0]) / double(columns),
                   static_cast<double>(corner[1]) / double(rows));
  };
  for (const std::vector<Corner>& loop : loops) {
    for (const Corner& corner : loop) add(corner);
    if (loops.size() > 1) add(loop.front());  // close it before the line to the next one
  }
  // Back along the lines between the loops.
  for (std::size_t i = loops.size() - 1; i-- > 1;) add(loops[i].front());
  return text + "\n";
}

}  // namespace ensonify::engine
