#pragma once

#include <ensonify/engine/seafloor/bed/fractal.h>
#include <ensonify/engine/seafloor/layers/relief_kind.h>

namespace ensonify::engine {

/// Fractal relief as a layer on a part of the bed.
const ReliefKind<FractalRelief>& kind_of(const FractalRelief&);

}  // namespace ensonify::engine
