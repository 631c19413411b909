#include <ensonify/engine/imitation/imitate.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <string_view>
#include <vector>

#include <fmt/format.h>

#include <ensonify/engine/comparison/comparison_page.h>

namespace ensonify::engine {
namespace {

struct Point {
  double x, y;
};
using Curve = std::vector<Point>;

/// A graph with the curves of recording and imitation, as SVG. Empty if one has no points.
std::string graph(std::string_view title, std::string_view x_axis, std::string_view y_axis,
                  const Curve& recording, const Curve& imitation) {
  constexpr double width = 460.0, height = 260.0, left = 55.0, bottom = 40.0, top = 25.0;
  Point low{1e30, 1e30}, high{-1e30, -1e30};
  for (const Curve* curve : {&recording, &imitation})
    for (const Point& p : *curve) {
      low = {std::min(low.x, p.x), std::min(low.y, p.y)};
      high = {std::max(high.x, p.x), std::max(high.y, p.y)};
    }
  if (recording.empty() || imitation.empty() || !(high.x > low.x)) return "";
  if (!(high.y > low.y)) high.y = low.y + 1.0;
  const auto place = [&](const Point& p) {
    return Point{left + (p.x - low.x) / (high.x - low.x) * (width - left - 10.0),
                 top + (high.y - p.y) / (high.y - low.y) * (height - top - bottom)};
  };
  std::string svg = fmt::format(
      "<figure><svg width=\"{0}\" height=\"{1}\" viewBox=\"0 0 {0} {1}\" font-size=\"12\" "
      "fill=\"currentColor\"><text x=\"{2}\" y=\"15\">{3}</text>\n",
      width, height, left, title);
  const auto line = [&](const Curve& curve, std::string_view colour) {
    std::string points;
    for (const Point& p : curve) {
      const Point at = place(p);
      points += fmt::format("{:.1f},{:.1f} ", at.x, at.y);
    }
    svg +=
        fmt::format("<polyline points=\"{}\" fill=\"none\" stroke=\"{}\" stroke-width=\"1.5\"/>\n",
                    points, colour);
  };
  line(recording, "#888");
  line(imitation, "#d33");
  const Point corner = place(low), end = place(high);
  svg += fmt::format(
      "<path d=\"M{0:.1f} {1:.1f}V{2:.1f}H{3:.1f}\" fill=\"none\" stroke=\"currentColor\"/>"
      "<text x=\"{0:.1f}\" y=\"{4:.1f}\">{5:.3g}</text><text x=\"{3:.1f}\" y=\"{4:.1f}\" "
      "text-anchor=\"end\">{6:.3g}</text><text x=\"{7:.1f}\" y=\"{4:.1f}\" "
      "text-anchor=\"middle\">{8}</text><text x=\"{9:.1f}\" y=\"{2:.1f}\" "
      "text-anchor=\"end\">{10:.3g}</text><text x=\"{9:.1f}\" y=\"{1:.1f}\" "
      "text-anchor=\"end\">{11:.3g}</text><text x=\"12\" y=\"{12:.1f}\" transform=\"rotate(-90 "
      "12 {12:.1f})\" text-anchor=\"middle\">{13}</text></svg></figure>\n",
      corner.x, end.y, corner.y, end.x, corner.y + 16.0, low.x, high.x, 0.5 * (corner.x + end.x),
      x_axis, corner.x - 4.0, low.y, high.y, 0.5 * (corner.y + end.y), y_axis);
  return svg;
}

/// The points of one curve, for the recording and for the imitation: each part of the curve has its
/// middle and the value of its statistic.
std::array<Curve, 2> curves(const Imitation& made, StatisticCurve curve) {
  std::array<Curve, 2> both;
  for (const ComparedStatistic& one : made.statistics) {
    if (one.part.curve != curve) continue;
    const double middle = 0.5 * (one.part.low + one.part.high);
    if (std::isfinite(one.a)) both[0].push_back({middle, one.a});
    if (std::isfinite(one.b)) both[1].push_back({middle, one.b});
  }
  return both;
}

/// The histogram of the bed's amplitudes divided by their mean, of both sides, in percent.
Curve histogram(const LineWithBed& line) {
  constexpr std::size_t bars = 60;
  constexpr double most = 4.0;
  std::vector<double> values;
  double sum = 0.0;
  for (const Side side : line.sides()) {
    const std::vector<std::size_t>& bed = line.bed(side).first_sample;
    for (std::size_t ping = 0; ping < line.pings.size(); ++ping)
      for (std::size_t k = bed[ping]; k < line.samples; ++k) {
        values.push_back(line.row(side, ping)[k]);
        sum += values.back();
      }
  }
  if (!(sum > 0.0)) return {};
  const double mean = sum / static_cast<double>(values.size());
  std::array<double, bars> counts{};
  for (const double value : values)
    counts[std::min(static_cast<std::size_t>(value / mean / most * bars), bars - 1)] += 1.0;
  Curve curve;
  for (std::size_t i = 0; i < bars; ++i)
    curve.push_back({(static_cast<double>(i) + 0.5) * most / bars,
                     100.0 * counts[i] / static_cast<double>(values.size())});
  return curve;
}

/// The range of the first return by ping, of port if the line has it.
Curve first_returns(const LineWithBed& line) {
  const Side side = line.port.empty() ? Side::starboard : Side::port;
  const std::vector<std::size_t>& bed = line.bed(side).first_sample;
  Curve curve;
  for (std::size_t ping = 0; ping < bed.size(); ++ping)
    if (bed[ping] < line.samples)
      curve.push_back({static_cast<double>(ping), line.sample_range_m(ping, bed[ping])});
  return curve;
}

}  // namespace

std::string imitation_page(const std::string& name, const Imitation& made) {
  std::string page = page_begin("A recording and its imitation");
  page += picture_section(name, made.line, "its imitation", made.imitated);
  page +=
      "<h2>How alike they are</h2>\n<p>Grey: the recording; red: the imitation. Of pings "
      "that the fit did not see; the vehicle's path alone is that of all pings.</p>\n";
  const auto add = [&](std::string_view title, std::string_view x_axis, std::string_view y_axis,
                       const std::array<Curve, 2>& both) {
    page += graph(title, x_axis, y_axis, both[0], both[1]);
  };
  add("Level over grazing angle", "degrees", "dB",
      curves(made, StatisticCurve::level_over_grazing));
  add("Level over range", "% of the range", "dB", curves(made, StatisticCurve::level_over_range));
  add("Contrast over grazing angle", "degrees", "sd / mean",
      curves(made, StatisticCurve::contrast_over_grazing));
  add("Amplitudes of the bed", "over their mean", "%",
      {histogram(made.judged), histogram(made.judged_imitated)});
  add("First return, all pings", "ping", "m",
      {first_returns(made.line), first_returns(made.imitated)});
  page += statistics_section(name, "its imitation", made.statistics);
  page +=
      "<h2>What the scene has, and what it rests on</h2>\n<table><tr><th>key</th>"
      "<th>value</th><th>how</th><th>why</th></tr>\n";
  for (const FoundKey& key : found_keys(made.model))
    page += fmt::format(
        "<tr><td>{}</td><td>{}</td><td>{}</td><td style=\"text-align:left\">{}"
        "</td></tr>\n",
        key.name(), html_text(key.value), name_of(key.evidence.how), html_text(key.evidence.why));
  page += "</table>\n<h2>What the recording does not show</h2>\n<ul>\n";
  for (const std::string& what : made.unknown)
    page += fmt::format("<li>{}</li>\n", html_text(what));
  return page + "</ul></body></html>\n";
}

}  // namespace ensonify::engine
