#pragma once

#include <span>
#include <string>

#include <ensonify/engine/comparison/line_statistics.h>
#include <ensonify/engine/image/display.h>
#include <ensonify/engine/recording/recorded_line.h>

namespace ensonify::engine {

/// A line as a grey picture of at most 1000 x 1500 pixels, port left and the newest ping on top. A
/// pixel shows the largest of the samples that it covers, divided by the 99.5th percentile of these
/// maxima (white), to the power of 0.6.
Picture picture_of(const RecordedLine& line);

/// The parts of a page in HTML: the beginning up to the heading, the pictures of two lines, and the
/// table of their statistics. The caller ends the page with `</body></html>`.
std::string page_begin(const std::string& title);
std::string picture_section(const std::string& name_a, const RecordedLine& a,
                            const std::string& name_b, const RecordedLine& b);
std::string statistics_section(const std::string& name_a, const std::string& name_b,
                               std::span<const ComparedStatistic> statistics);
/// A text with the characters that HTML reserves escaped.
std::string html_text(const std::string& text);

/// A page in HTML with the pictures of two lines side by side and the table of their statistics.
/// The page needs no other file.
std::string comparison_page(const std::string& name_a, const RecordedLine& a,
                            const std::string& name_b, const RecordedLine& b,
                            std::span<const ComparedStatistic> statistics);

}  // namespace ensonify::engine
