#pragma once

#include <cstddef>
#include <span>
#include <string>

#include <ensonify/engine/ping_all.h>
#include <ensonify/engine/scene/scene.h>

namespace ensonify::engine {

/// The parts of a run: consecutive pings that have files of their own. A run of one part has its
/// files in its folder: NAME.exr, ...; a run of several has them in part_0001/NAME_0001.exr, ...
class RunParts {
 public:
  RunParts(std::size_t pings, std::size_t pings_per_part);

  std::size_t count() const;
  std::size_t pings() const { return pings_; }
  std::size_t pings_per_part() const { return pings_per_part_; }
  PingRange range(std::size_t part) const;
  /// The number of a part in names, from 0001.
  std::string number(std::size_t part) const;
  std::string folder(std::size_t part) const;  ///< part_0001

 private:
  std::size_t pings_, pings_per_part_;
};

/// How many pings a part has: output.pings_per_file; if that is 0, all pings if their images take
/// 1 GiB at most, else as many as take 64 MiB.
std::size_t pings_per_part(const OutputOptions& output, std::span<const Sonar> sonars,
                           std::size_t pings);

}  // namespace ensonify::engine
