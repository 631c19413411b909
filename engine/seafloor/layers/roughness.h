#pragma once

#include <ensonify/engine/seafloor/bed/fractal.h>
#include <ensonify/engine/seafloor/layers/relief_kind.h>

namespace ensonify::engine {

/// The fractal relief of the bed, as a layer on a part of it.
const ReliefKind<FractalRelief>& kind_of(const FractalRelief&);

}  // namespace ensonify::engine
