#pragma once

#include <cstdio>
#include <string>
#include <utility>

#include <fmt/format.h>

namespace ensonify::engine::app {

/// Writes to stderr. That it cannot be written, as a log on a full disk, is no fault of the work.
template <class... Values>
void tell(fmt::format_string<Values...> format, Values&&... values) {
  const std::string text = fmt::format(format, std::forward<Values>(values)...);
  [[maybe_unused]] const auto written = std::fwrite(text.data(), 1, text.size(), stderr);
}

}  // namespace ensonify::engine::app
