#include <ensonify/engine/output/targets_json.h>

#include <cmath>
#include <numbers>

#include <nlohmann/json.hpp>

namespace ensonify::engine {
namespace {

using Json = nlohmann::ordered_json;

constexpr double degrees_per_radian = 180.0 / std::numbers::pi;

Json vector_json(const Eigen::Vector3d& v) { return {v.x(), v.y(), v.z()}; }

Json outline_json(const Outline& outline, const Waterfall& picture) {
  if (outline.area_px == 0) return nullptr;
  Json polygons = Json::array();
  for (const std::vector<Corner>& polygon : outline.polygons) {
    Json& flat = polygons.emplace_back(Json::array());
    for (const Corner& corner : polygon) {
      flat.push_back(corner[0]);
      flat.push_back(corner[1]);
    }
  }
  Json json = {{"box",
                {outline.low[0], outline.low[1], outline.high[0] - outline.low[0],
                 outline.high[1] - outline.low[1]}},
               {"area_px", outline.area_px},
               {"polygons", polygons}};
  if (!outline.runs.empty())
    json["rle"] = {{"size", {picture.rows(), picture.columns()}}, {"counts", outline.runs}};
  return json;
}

/// From 0 to 360 degrees.
double turned_deg(double rad) {
  const double degrees = std::fmod(rad * degrees_per_radian, 360.0);
  return degrees < 0.0 ? degrees + 360.0 : degrees;
}

/// What is known of the thing itself: an object, or behind those a feature of the bed.
Json thing_json(const Target& target, const Pose& pose, const Seafloor& seafloor,
                std::span<const ObjectView> views) {
  const auto named = [&](const Label& label, const Eigen::Vector3d& middle_m,
                         const Eigen::Vector3d& size_m) {
    return Json{{"instance", target.instance},
                {"class", seafloor.classes.at(label.class_id)},
                {"material", seafloor.materials.at(label.sediment)},
                {"middle_m", vector_json(middle_m)},
                {"size_m", vector_json(size_m)}};
  };
  const std::size_t number = target.instance - 1;
  if (number >= seafloor.objects.size()) {
    const FeatureRecord& feature = seafloor.features.at(number - seafloor.objects.size());
    Json json = named(feature.label, feature.middle_m, feature.size_m);
    json["layer"] = feature.layer;
    return json;
  }
  const ObjectRecord& object = seafloor.objects[number];
  const double sight_rad =
      pose.heading_rad + (target.side == Side::port ? -0.5 : 0.5) * std::numbers::pi;
  Json json = named(object.label, object.middle_m, object.size_m);
  json["table"] = object.table;
  json["heading_deg"] = turned_deg(object.heading_rad);
  json["scale"] = object.scale;
  json["buried"] = object.buried;
  json["aspect_deg"] = turned_deg(sight_rad - object.heading_rad);
  const bool viewed = number < views.size() && views[number].alone > 0;
  json["visible_fraction"] = viewed ? Json(views[number].share()) : Json(nullptr);
  return json;
}

}  // namespace

std::string targets_json(std::span<const Target> targets, const Waterfall& waterfall,
                         const Seafloor& seafloor, std::span<const ObjectView> views) {
  Json list = Json::array();
  for (const Target& target : targets) {
    const Pose& pose = waterfall.pings.at(static_cast<std::size_t>(target.ping)).pose;
    Json& json = list.emplace_back(thing_json(target, pose, seafloor, views));
    json["range_m"] = target.range_m;
    json["side"] = target.side == Side::port ? "port" : "starboard";
    json["ping"] = target.ping;
    json["contrast_db"] = target.contrast_db ? Json(*target.contrast_db) : Json(nullptr);
    json["body"] = outline_json(target.body, waterfall);
    json["shadow"] = outline_json(target.shadow, waterfall);
  }
  const Json json = {{"picture",
                      {{"columns", waterfall.columns()},
                       {"rows", waterfall.rows()},
                       {"row_order", "newest_first"}}},
                     {"objects", seafloor.objects.size()},
                     {"features", seafloor.features.size()},
                     {"targets", list}};
  return json.dump(1, ' ', false, Json::error_handler_t::replace) + "\n";
}

}  // namespace ensonify::engine
