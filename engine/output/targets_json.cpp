#include <ensonify/engine/output/targets_json.h>

#include <cmath>
#include <numbers>

#include <nlohmann/json.hpp>

namespace ensonify::engine {
namespace {

using Json = nlohmann::ordered_json;

constexpr double degrees_per_radian = 180.0 / std::numbers::pi;

Json vector_json(const Eigen::Vector3d& v) { return {v.x(), v.y(), v.z()}; }

Json outline_json(const Outline& outline) {
  if (outline.area_px == 0) return nullptr;
  Json polygons = Json::array();
  for (const std::vector<Corner>& polygon : outline.polygons) {
    Json& flat = polygons.emplace_back(Json::array());
    for (const Corner& corner : polygon) {
      flat.push_back(corner[0]);
      flat.push_back(corner[1]);
    }
  }
  return {{"box",
           {outline.low[0], outline.low[1], outline.high[0] - outline.low[0],
            outline.high[1] - outline.low[1]}},
          {"area_px", outline.area_px},
          {"polygons", polygons}};
}

/// From 0 to 360 degrees.
double turned_deg(double rad) {
  const double degrees = std::fmod(rad * degrees_per_radian, 360.0);
  return degrees < 0.0 ? degrees + 360.0 : degrees;
}

}  // namespace

std::string targets_json(std::span<const Target> targets, const Waterfall& waterfall,
                         const Seafloor& seafloor) {
  Json list = Json::array();
  for (const Target& target : targets) {
    const ObjectRecord& object = seafloor.objects.at(target.instance - 1);
    const Pose& pose = waterfall.pings.at(static_cast<std::size_t>(target.ping)).pose;
    const double sight_rad =
        pose.heading_rad + (target.side == Side::port ? -0.5 : 0.5) * std::numbers::pi;
    list.push_back({{"instance", target.instance},
                    {"class", seafloor.classes.at(object.label.class_id)},
                    {"material", seafloor.materials.at(object.label.sediment)},
                    {"table", object.table},
                    {"middle_m", vector_json(object.middle_m)},
                    {"size_m", vector_json(object.size_m)},
                    {"heading_deg", turned_deg(object.heading_rad)},
                    {"scale", object.scale},
                    {"buried", object.buried},
                    {"range_m", target.range_m},
                    {"side", target.side == Side::port ? "port" : "starboard"},
                    {"ping", target.ping},
                    {"aspect_deg", turned_deg(sight_rad - object.heading_rad)},
                    {"contrast_db", target.contrast_db ? Json(*target.contrast_db) : Json(nullptr)},
                    {"body", outline_json(target.body)},
                    {"shadow", outline_json(target.shadow)}});
  }
  const Json json = {{"picture",
                      {{"columns", waterfall.columns()},
                       {"rows", waterfall.rows()},
                       {"row_order", "newest_first"}}},
                     {"objects", seafloor.objects.size()},
                     {"targets", list}};
  return json.dump(1, ' ', false, Json::error_handler_t::replace) + "\n";
}

}  // namespace ensonify::engine
