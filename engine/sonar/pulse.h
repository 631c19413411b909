#pragma once

#include <vector>

namespace ensonify::engine {

/// What a pulse makes of neighbouring bins: kernel[d] is the intensity in a bin per energy in the bin
/// d places off, either way. The pulse's energy response is a box, one range cell (c tau_e / 2) long
/// and centred on the echo; bins are averages over their own length. The whole kernel, both ways,
/// sums to cell / bin: an even bed of energy g per metre has the intensity g c tau_e / 2.
std::vector<double> pulse_kernel(double cell_m, double bin_m);

}  // namespace ensonify::engine
