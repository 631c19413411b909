#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include <ensonify/engine/image/truth.h>

namespace ensonify::engine {

/// The borders of a set of pixels, also around holes, as closed loops of corners along pixel edges.
/// A point lies in the set if it is inside an odd number of loops. `runs` are COCO's run lengths
/// over a picture with `rows` rows, as in Outline::runs.
std::vector<std::vector<Corner>> loops_of(std::span<const std::size_t> runs, std::size_t rows);

/// A row of YOLO's segmentation format: class number from 0, then the corners of one polygon,
/// divided by the picture's size. Lines from loop to loop, and back on the same way, join all loops
/// to one polygon. Filled by the even-odd rule it has the same holes. Ends with a line feed; empty
/// without loops.
std::string yolo_segment(std::size_t class_number, std::span<const std::vector<Corner>> loops,
                         std::size_t columns, std::size_t rows);

}  // namespace ensonify::engine
