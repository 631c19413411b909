#pragma once

#include <string>

#include <nlohmann/json_fwd.hpp>

namespace ensonify::bench {

/// A report as one self-contained page: charts as SVG, light and dark, and in words where each
/// scheme wins and loses.
std::string html(const nlohmann::ordered_json& report);

}  // namespace ensonify::bench
