#include "app.h"
#include "check_parts.h"

#include <cmath>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <nlohmann/json.hpp>

namespace ensonify::engine::app {

std::string csv(const std::vector<AgreementRow>& rows) {
  std::string out = "surface,intersector,source,rays";
  for (const std::string_view verdict : verdict_names) out += fmt::format(",{}", verdict);
  out +=
      ",largest_dt_m,largest_dt_relative,largest_dt_of_tolerance,coarse,unlike_static,wrong_index,"
      "wrong_run,over_limit,overlap\n";
  for (const AgreementRow& row : rows) {
    out += fmt::format("{},{},{},{}", row.surface, row.intersector,
                       ray_source_names[static_cast<std::size_t>(row.source)], row.rays);
    for (const std::uint64_t count : row.verdicts) out += fmt::format(",{}", count);
    out += fmt::format(",{:.3g},{:.3g},{:.3g},{},{},{},{},{},{}\n", row.largest_dt_m,
                       row.largest_dt_relative, row.largest_dt_of_tolerance, row.coarse,
                       row.unlike_static, row.wrong_index, row.wrong_run,
                       fmt::join(exceeded_limits(row), "+"), row.overlap);
  }
  return out;
}

nlohmann::ordered_json to_json(const AgreementRow& row) {
  nlohmann::ordered_json json = {{"surface", row.surface},
                                 {"intersector", row.intersector},
                                 {"source", ray_source_names[static_cast<std::size_t>(row.source)]},
                                 {"rays", row.rays}};
  for (std::size_t i = 0; i < verdict_names.size(); ++i) json[verdict_names[i]] = row.verdicts[i];
  json["largest_dt_m"] = row.largest_dt_m;
  json["largest_dt_relative"] = row.largest_dt_relative;
  json["largest_dt_of_tolerance"] = row.largest_dt_of_tolerance;
  json["coarse"] = row.coarse;
  json["unlike_static"] = row.unlike_static;
  json["wrong_index"] = row.wrong_index;
  json["wrong_run"] = row.wrong_run;
  json["over_limit"] = exceeded_limits(row);
  json["overlap"] = row.overlap;
  nlohmann::ordered_json shares = nlohmann::ordered_json::object();
  for (const Limit& limit : limits(row.source, row.precision)) shares[limit.name] = limit.share;
  json["limits"] = shares;  // as shares of the rays; most_allowed() makes numbers of rays from them
  return json;
}

std::string report_limits(const std::vector<AgreementRow>& rows) {
  std::string lines;
  for (const AgreementRow& row : rows)
    for (const Limit& limit : limits(row.source, row.precision))
      if (exceeds(limit, row))
        lines += fmt::format("over the limit: {} {} {}: {} {} of {} rays, at most {:.0f}\n",
                             row.surface, row.intersector,
                             ray_source_names[static_cast<std::size_t>(row.source)], limit.name,
                             limit.of(row), row.rays, std::floor(most_allowed(limit, row.rays)));
  return lines;
}

void print_unexplained(const AgreementRow& row, const Eigen::Vector3d& world_origin) {
  const auto answer = [](const Hit& hit) {
    return hit ? fmt::format("face {}, t {:.17g}, u {:.17g}, v {:.17g}", hit.face, hit.t, hit.u,
                             hit.v)
               : "no face";
  };
  for (const Difference& d : row.unexplained) {
    const Eigen::Vector3d o = d.ray.origin + world_origin;
    print_note(
        "unexplained: {} {} {}\n  ox,oy,oz,dx,dy,dz,t_min,t_max\n  {:.17g},{:.17g},{:.17g},"
        "{:.17g},{:.17g},{:.17g},{:.17g},{:.17g}\n  reference: {}\n  found:     {}\n",
        row.surface, row.intersector, ray_source_names[static_cast<std::size_t>(row.source)], o.x(),
        o.y(), o.z(), d.ray.direction.x(), d.ray.direction.y(), d.ray.direction.z(), d.ray.t_min,
        d.ray.t_max, answer(d.expected), answer(d.found));
  }
}

}  // namespace ensonify::engine::app
