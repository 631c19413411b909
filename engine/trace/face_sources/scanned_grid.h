#pragma once

#include <memory>

#include <ensonify/engine/trace/face_source.h>

namespace ensonify::engine {

/// A bed of heights with objects on it. GridScan finds the runs of the bed, and fan_scan the runs
/// of the objects. If the bed does not allow this, or if hits are needed, `exact` answers instead,
/// with the same bits.
std::unique_ptr<FaceSource> make_scanned_grid(const FaceSourceParts& parts,
                                              std::unique_ptr<FaceSource> exact);

}  // namespace ensonify::engine
