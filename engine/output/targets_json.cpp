#include <ensonify/engine/output/targets_json.h>

#include <nlohmann/json.hpp>

#include <ensonify/engine/base/json_text.h>
#include <ensonify/engine/base/units.h>

namespace ensonify::engine {
namespace {

using Json = nlohmann::ordered_json;

constexpr double degrees_per_radian = 1.0 / degree;

Json vector_json(const Eigen::Vector3d& v) { return {v.x(), v.y(), v.z()}; }

/// `rows` and `columns` are the size of the picture.
Json outline_json(const Outline& outline, std::size_t rows, std::size_t columns) {
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
  if (!outline.runs.empty()) json["rle"] = {{"size", {rows, columns}}, {"counts", outline.runs}};
  return json;
}

/// `rows` and `columns` are the size of the picture.
Json target_json(const TargetRecord& record, std::size_t rows, std::size_t columns) {
  const Target& target = record.target;
  Json json = {{"instance", target.instance},
               {"class", record.class_name},
               {"material", record.material},
               {"middle_m", vector_json(record.middle_m)},
               {"size_m", vector_json(record.size_m)}};
  if (record.object) {
    const TargetRecord::Object& object = *record.object;
    json["table"] = object.table;
    json["heading_deg"] = turned_deg(object.heading_rad);
    json["scale"] = object.scale;
    json["buried"] = object.buried;
    json["aspect_deg"] = turned_deg(object.aspect_rad);
    json["visible_fraction"] = object.visible_share ? Json(*object.visible_share) : Json(nullptr);
  } else {
    json["layer"] = record.layer;
  }
  json["range_m"] = target.range_m;
  json["side"] = target.sight.sector();
  json["ping"] = target.ping;
  json["contrast_db"] = target.contrast_db ? Json(*target.contrast_db) : Json(nullptr);
  json["body"] = outline_json(target.body, rows, columns);
  json["shadow"] = outline_json(target.shadow, rows, columns);
  return json;
}

Json geometry_json(const ImageGeometry& geometry) {
  const Pose& pose = geometry.middle;
  return {{"frequency_hz", geometry.frequency_hz},
          {"range_m", geometry.range_m},
          {"sides", geometry.sides},
          {"across_m", {geometry.left_m, geometry.right_m}},
          {"pings", {geometry.first_ping, geometry.last_ping}},
          {"altitude_m", geometry.altitude_m},  // null for NaN
          {"time_s", pose.t_s},
          {"position_m", vector_json(pose.position)},
          {"roll_deg", pose.roll_rad * degrees_per_radian},
          {"pitch_deg", pose.pitch_rad * degrees_per_radian},
          {"heading_deg", turned_deg(pose.heading_rad)}};
}

std::string text_of(const Json& json) { return json_text(json, 1) + "\n"; }

}  // namespace

double turned_deg(double rad) { return compass_deg(rad * degrees_per_radian); }

std::string targets_json(std::span<const TargetRecord> targets, const Waterfall& waterfall,
                         const Seafloor& seafloor) {
  Json list = Json::array();
  for (const TargetRecord& record : targets)
    list.push_back(target_json(record, waterfall.rows(), waterfall.columns()));
  return text_of({{"picture",
                   {{"columns", waterfall.columns()},
                    {"rows", waterfall.rows()},
                    {"row_order", "newest_first"}}},
                  {"objects", seafloor.objects.size() + seafloor.moving.size()},
                  {"features", seafloor.features.size()},
                  {"targets", list}});
}

std::string labels_json(const ImageLabels& labels) {
  Json targets = Json::array();
  for (const TargetLabel& label : labels.targets) {
    Json& json = targets.emplace_back(target_json(label.record, labels.height, labels.width));
    json["shown_fraction"] = label.shown_fraction;
    json["truncated"] = label.truncated;
    json["ignored"] = label.ignored;
    json["category_id"] = label.category_id;
    if (label.bearing_rad) json["bearing_deg"] = *label.bearing_rad * degrees_per_radian;
  }
  Json json = {{"image", labels.image},
               {"pictures", labels.pictures},
               {"kind", labels.kind},
               {"of", labels.of.empty() ? Json(nullptr) : Json(labels.of)},
               {"of_instance", labels.of_instance > 0 ? Json(labels.of_instance) : Json()},
               {"geometry", labels.geometry},
               {"sonar", labels.sonar},
               {"width", labels.width},
               {"height", labels.height},
               {"of_line", {labels.column, labels.row, labels.columns, labels.rows}},
               {"pixel_across_m", labels.pixel_across_m},
               {"pixel_along_m", labels.pixel_along_m},
               {"seen_from", geometry_json(labels.seen_from)},
               {"split", labels.split},
               {"classes", labels.classes},
               {"targets", targets}};
  if (labels.frame) json["frame"] = *labels.frame;
  return text_of(json);
}

}  // namespace ensonify::engine
