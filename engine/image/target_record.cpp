#include <ensonify/engine/image/target_record.h>

#include <algorithm>
#include <cmath>
#include <utility>

namespace ensonify::engine {
namespace {

/// The time of the row that is nearest to a target's mean ping.
double time_of(const Target& target, const Waterfall& waterfall) {
  const auto row = static_cast<std::size_t>(
      std::max(0.0, std::round(target.ping - static_cast<double>(waterfall.pings[0].number))));
  return waterfall.pings[std::min(row, waterfall.rows() - 1)].pose.t_s;
}

/// What a moving object is at a time: the box around it is that of its start.
ObjectRecord record_at(const MovingRecord& moving, double t_s) {
  const ObjectPose pose = moving.way.at(t_s);
  ObjectRecord record = moving.record;
  record.middle_m = pose.place_m;
  record.heading_rad += pose.heading_rad;
  return record;
}

TargetRecord record_of(Target target, const Waterfall& waterfall, const Seafloor& seafloor,
                       std::span<const ObjectVisibility> views) {
  const auto labelled = [&](const auto& thing) {
    return TargetRecord{.target = std::move(target),
                        .class_name = seafloor.classes.at(thing.label.class_id),
                        .material = seafloor.materials.at(thing.label.sediment),
                        .middle_m = thing.middle_m,
                        .size_m = thing.size_m};
  };
  const auto of_object = [&](const ObjectRecord& object) {
    TargetRecord record = labelled(object);
    record.object = {.table = object.table,
                     .heading_rad = object.heading_rad,
                     .scale = object.scale,
                     .buried = object.buried,
                     .aspect_rad = record.target.sight.direction_rad() - object.heading_rad};
    return record;
  };
  const std::size_t objects = seafloor.objects.size(), fixed = objects + seafloor.features.size(),
                    number = target.instance - 1;
  if (number >= fixed)
    return of_object(record_at(seafloor.moving.at(number - fixed), time_of(target, waterfall)));
  if (number >= objects) {
    const FeatureRecord& feature = seafloor.features[number - objects];
    TargetRecord record = labelled(feature);
    record.layer = feature.layer;
    return record;
  }
  TargetRecord record = of_object(seafloor.objects[number]);
  if (number < views.size() && views[number].alone > 0)
    record.object->visible_share = views[number].share();
  return record;
}

}  // namespace

std::vector<TargetRecord> target_records(const Waterfall& waterfall, const Seafloor& seafloor,
                                         std::span<const ObjectVisibility> views) {
  std::vector<TargetRecord> records;
  for (Target& target : find_targets(waterfall))
    records.push_back(record_of(std::move(target), waterfall, seafloor, views));
  return records;
}

}  // namespace ensonify::engine
