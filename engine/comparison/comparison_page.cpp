#include <ensonify/engine/comparison/comparison_page.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <vector>

#include <cpl_conv.h>
#include <cpl_string.h>
#include <fmt/format.h>

#include <ensonify/engine/image/line_layout.h>
#include <ensonify/engine/output/png.h>

namespace ensonify::engine {
namespace {

constexpr std::size_t max_columns = 1000, max_rows = 1500;

/// The number of values per pixel so that `values` values take at most `most` pixels.
std::size_t covered(std::size_t values, std::size_t most) {
  return std::max<std::size_t>(1, (values + most - 1) / most);
}

std::string png_source(const Picture& picture) {
  const std::vector<std::byte> png = encode_png(picture);
  const std::unique_ptr<char, decltype(&VSIFree)> text(
      CPLBase64Encode(static_cast<int>(png.size()), reinterpret_cast<const GByte*>(png.data())),
      &VSIFree);
  return fmt::format("data:image/png;base64,{}", text.get());
}

std::string cell(double value) {
  return std::isnan(value) ? "<td>&ndash;</td>" : fmt::format("<td>{:.4g}</td>", value);
}

}  // namespace

std::string html_text(const std::string& text) {
  const std::unique_ptr<char, decltype(&VSIFree)> safe(CPLEscapeString(text.c_str(), -1, CPLES_XML),
                                                       &VSIFree);
  return safe.get();
}

Picture picture_of(const RecordedLine& line) {
  const std::vector<Side> sides = line.sides();
  const std::size_t per_column = covered(sides.size() * line.samples, max_columns);
  const std::size_t per_row = covered(line.pings.size(), max_rows);
  const LineLayout layout(line.port.empty()        ? Sides::starboard
                          : line.starboard.empty() ? Sides::port
                                                   : Sides::both,
                          (line.samples + per_column - 1) / per_column);
  const std::size_t width = layout.columns(), height = (line.pings.size() + per_row - 1) / per_row;
  std::vector<float> largest(width * height, 0.0f);
  for (std::size_t sector = 0; sector < sides.size(); ++sector)
    for (std::size_t ping = 0; ping < line.pings.size(); ++ping)
      for (std::size_t k = 0; k < line.samples; ++k) {
        float& pixel = largest[(height - 1 - ping / per_row) * width +
                               layout.column({sector, k / per_column})];
        pixel = std::max(pixel, line.row(sides[sector], ping)[k]);
      }
  std::vector<float> sorted = largest;
  const auto white =
      sorted.begin() + static_cast<std::ptrdiff_t>(0.995 * double(sorted.size() - 1));
  std::nth_element(sorted.begin(), white, sorted.end());
  Picture picture{width, height, 1, std::vector<std::uint8_t>(width * height)};
  for (std::size_t i = 0; i < largest.size(); ++i)
    picture.pixels[i] = static_cast<std::uint8_t>(std::lround(
        255.0 * std::pow(*white > 0.0f ? std::min(largest[i] / *white, 1.0f) : 0.0f, 0.6)));
  return picture;
}

std::string page_begin(const std::string& title) {
  return fmt::format(R"(<!DOCTYPE html>
<html lang="en"><head><meta charset="utf-8"><title>{0}</title>
<meta name="viewport" content="width=device-width"><style>
:root {{ color-scheme: light dark; font-family: sans-serif; }}
figure {{ display: inline-block; vertical-align: top; margin: 0 1em 1em 0; max-width: 48%; }}
img {{ width: 100%; image-rendering: auto; }}
table {{ border-collapse: collapse; }}
td, th {{ padding: 0.1em 0.8em; text-align: right; }}
td:first-child, th:first-child {{ text-align: left; }}
tr.apart {{ font-weight: bold; }}
</style></head><body>
<h1>{0}</h1>
)",
                     html_text(title));
}

std::string picture_section(const std::string& name_a, const RecordedLine& a,
                            const std::string& name_b, const RecordedLine& b) {
  std::string section;
  for (const auto& [name, line] : {std::pair{&name_a, &a}, {&name_b, &b}})
    section += fmt::format(
        "<figure><img alt=\"Waterfall of {0}\" src=\"{1}\"><figcaption>{0}: {2} pings of {3} "
        "samples, newest on top, port left</figcaption></figure>\n",
        html_text(*name), png_source(picture_of(*line)), line->pings.size(), line->samples);
  return section;
}

std::string statistics_section(const std::string& name_a, const std::string& name_b,
                               std::span<const ComparedStatistic> statistics) {
  const Likeness alike = likeness(statistics);
  std::string section = fmt::format(
      "<p>The ratio is the difference over the spread between the halves of {}. Rows with a ratio "
      "over 1 are bold; {} of {} have a ratio of at most 1. In decibels: {}.</p>\n<table><tr><th>statistic</th><th>{}</th><th>{}</th><th>spread</th>"
      "<th>ratio</th></tr>\n",
      html_text(name_a), alike.within, alike.known, alike.decibels(), html_text(name_a),
      html_text(name_b));
  for (const ComparedStatistic& one : statistics)
    section +=
        fmt::format("<tr{}><td>{}</td>{}{}{}{}</tr>\n", one.ratio() > 1.0 ? " class=\"apart\"" : "",
                    one.name, cell(one.a), cell(one.b), cell(one.spread), cell(one.ratio()));
  return section + "</table>\n";
}

std::string comparison_page(const std::string& name_a, const RecordedLine& a,
                            const std::string& name_b, const RecordedLine& b,
                            std::span<const ComparedStatistic> statistics) {
  return page_begin("Two lines compared") + picture_section(name_a, a, name_b, b) +
         statistics_section(name_a, name_b, statistics) + "</body></html>\n";
}

}  // namespace ensonify::engine
