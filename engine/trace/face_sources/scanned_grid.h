#pragma once

#include <memory>

#include <ensonify/engine/trace/face_source.h>

namespace ensonify::engine {

/// A bed of heights whose runs are found by GridScan, and those of the objects on it by fan_scan.
/// Where the bed does not allow that, and for hits, `exact` answers, with the same bits.
std::unique_ptr<FaceSource> make_scanned_grid(const FaceSourceParts& parts,
                                              std::unique_ptr<FaceSource> exact);

}  // namespace ensonify::engine
