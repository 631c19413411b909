#pragma once

namespace ensonify::engine {

/// What a sound speed profile does to rays: nothing, only their travel times, or all of it.
enum class RefractionMode { off, time_only, full };

}  // namespace ensonify::engine
