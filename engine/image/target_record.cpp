#include <ensonify/engine/image/target_record.h>

#include <utility>

namespace ensonify::engine {
namespace {

TargetRecord record_of(Target target, const Seafloor& seafloor,
                       std::span<const ObjectVisibility> views) {
  const auto labelled = [&](const auto& thing) {
    return TargetRecord{.target = std::move(target),
                        .class_name = seafloor.classes.at(thing.label.class_id),
                        .material = seafloor.materials.at(thing.label.sediment),
                        .middle_m = thing.middle_m,
                        .size_m = thing.size_m};
  };
  const std::size_t number = target.instance - 1;
  if (number >= seafloor.objects.size()) {
    const FeatureRecord& feature = seafloor.features.at(number - seafloor.objects.size());
    TargetRecord record = labelled(feature);
    record.layer = feature.layer;
    return record;
  }
  const ObjectRecord& object = seafloor.objects[number];
  TargetRecord record = labelled(object);
  record.object = {.table = object.table,
                   .heading_rad = object.heading_rad,
                   .scale = object.scale,
                   .buried = object.buried,
                   .aspect_rad = record.target.sight.direction_rad() - object.heading_rad};
  if (number < views.size() && views[number].alone > 0)
    record.object->visible_share = views[number].share();
  return record;
}

}  // namespace

std::vector<TargetRecord> target_records(const Waterfall& waterfall, const Seafloor& seafloor,
                                         std::span<const ObjectVisibility> views) {
  std::vector<TargetRecord> records;
  for (Target& target : find_targets(waterfall))
    records.push_back(record_of(std::move(target), seafloor, views));
  return records;
}

}  // namespace ensonify::engine
