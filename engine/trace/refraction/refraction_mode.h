#pragma once

namespace ensonify::engine {

/// What a sound speed profile changes: nothing, only the travel times of rays, or their paths too.
enum class RefractionMode { off, time_only, full };

}  // namespace ensonify::engine
