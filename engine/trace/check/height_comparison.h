#pragma once

#include <cstddef>

#include <ensonify/engine/trace/check/fan_comparison.h>
#include <ensonify/engine/trace/check/judge.h>
#include <ensonify/engine/trace/intersector.h>

namespace ensonify::engine {

/// The first of the bed's faces that a vertical ray meets. Faces with the number `bed_faces` or a
/// higher one are not the bed's: the ray passes them. The reference must answer lists of rays.
Hit bed_below(Ray ray, std::size_t bed_faces, const Intersector& reference);

/// Compares a height (m, NaN for none) with the bed's hit below, and counts one ray.
void judge_height(const Judge& judge, const Ray& ray, const Hit& bed, double height_m,
                  AgreementCounts& counts);

}  // namespace ensonify::engine
