#pragma once

#include <string>
#include <vector>

#include <Eigen/Core>
#include <nlohmann/json_fwd.hpp>

#include <ensonify/engine/trace/check/limits.h>

namespace ensonify::engine::app {

/// The table of a comparison as CSV.
std::string csv(const std::vector<AgreementRow>& rows);
nlohmann::ordered_json to_json(const AgreementRow& row);

/// One line per exceeded limit: "over the limit: static embree scene: tie 0.012 of the rays, ...".
std::string report_limits(const std::vector<AgreementRow>& rows);

/// Prints to stderr what is needed to reproduce each difference. `ensonify seafloor` writes the
/// mesh, and `ensonify trace` traces the ray if it is straight. For a bent ray, the direction in
/// which it starts is printed.
void print_unexplained(const AgreementRow& row, const Eigen::Vector3d& world_origin);

}  // namespace ensonify::engine::app
