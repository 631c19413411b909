#include <ensonify/engine/seafloor/objects/buried_surfaces.h>

#include <algorithm>
#include <cmath>

namespace ensonify::engine {
namespace {

constexpr double longest_m = 2.0;     // greatest length of a part
constexpr double tallest_m = 0.05;    // greatest difference of height between the ends of a part
constexpr double most_cuts = 256.0;   // of a side of any length
constexpr double min_slope_m = 0.05;  // least distance to each side, for the bed's slope
constexpr std::size_t parts_per_group = 64;

/// The number of pieces into which a side of a flat part is cut.
int cuts(const Eigen::Vector3f& axis, float length_m) {
  const double tall_m = std::abs(double(axis.z())) * double(length_m);
  return static_cast<int>(std::ceil(
      std::clamp(std::max(double(length_m) / longest_m, tall_m / tallest_m), 1.0, most_cuts)));
}

/// Sets the plane of the bed above a part. Returns false if there is no bed above the part.
bool find_bed(const BedAt& bed, BuriedPart& part) {
  const Eigen::Vector3d& at = part.flat.middle;
  const std::optional<BedPoint> top = bed(at.x(), at.y());
  if (!top || !(top->height_m > at.z())) return false;
  const double reach_m = std::max(top->height_m - at.z(), min_slope_m);
  const auto slope = [&](double east, double north) {
    const auto one = bed(at.x() + reach_m * east, at.y() + reach_m * north);
    const auto other = bed(at.x() - reach_m * east, at.y() - reach_m * north);
    return one && other ? (one->height_m - other->height_m) / (2.0 * reach_m) : 0.0;
  };
  part.bed_normal = Eigen::Vector3d(-slope(1.0, 0.0), -slope(0.0, 1.0), 1.0).normalized();
  part.depth_m = (top->height_m - at.z()) * part.bed_normal.z();
  part.bed_face = top->face;
  return true;
}

void enclose(BuriedGroup& group) {
  Eigen::AlignedBox3d box;
  for (const BuriedPart& part : group.parts) box.extend(part.flat.middle);
  group.middle = box.center();
  for (const BuriedPart& part : group.parts)
    group.radius_m = std::max(group.radius_m, (part.flat.middle - group.middle).norm() +
                                                  0.5 * double(part.flat.length_m) +
                                                  0.5 * double(part.flat.width_m));
}

}  // namespace

std::vector<BuriedGroup> buried_surfaces(const std::vector<ObjectSurface>& objects,
                                         const BedAt& bed, double thickness_m) {
  std::vector<BuriedGroup> groups;
  if (!(thickness_m > 0.0)) return groups;
  for (const ObjectSurface& object : objects) {
    BuriedGroup group{.label = object.label, .curved = &object.curved};
    const auto finish = [&] {
      if (group.parts.empty()) return;
      enclose(group);
      groups.push_back(std::move(group));
      group = {.label = object.label, .curved = &object.curved};
    };
    for (const FlatPart& flat_part : object.flat_parts) {
      const int along = cuts(flat_part.along, flat_part.length_m),
                across = cuts(flat_part.across, flat_part.width_m);
      for (int i = 0; i < along * across; ++i) {
        BuriedPart part{.flat = flat_part, .whole = &flat_part};
        part.flat.length_m /= static_cast<float>(along);
        part.flat.width_m /= static_cast<float>(across);
        const auto off_m = [](int number, int count, float length_m) {
          return (number + 0.5 - 0.5 * count) * double(length_m);
        };
        part.flat.middle +=
            off_m(i % along, along, part.flat.length_m) * flat_part.along.cast<double>() +
            off_m(i / along, across, part.flat.width_m) * flat_part.across.cast<double>();
        if (!find_bed(bed, part) || part.depth_m > thickness_m) continue;
        group.parts.push_back(std::move(part));
      }
      if (group.parts.size() >= parts_per_group) finish();
    }
    finish();
  }
  return groups;
}

}  // namespace ensonify::engine
