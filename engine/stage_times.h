#pragma once

namespace ensonify::engine {

/// The seconds spent in the stages of pings, summed over pings.
struct StageTimes {
  double surface_s = 0.0;  ///< preparing the faces; in trace_s if only runs are found
  double trace_s = 0.0;    ///< nearest hits, or runs
  double echo_s = 0.0;     ///< scattering and binning
  double receive_s = 0.0;  ///< the receiver: from the scatterers to the recorder's samples

  StageTimes& operator+=(const StageTimes& other) {
    surface_s += other.surface_s;
    trace_s += other.trace_s;
    echo_s += other.echo_s;
    receive_s += other.receive_s;
    return *this;
  }
  StageTimes operator-(const StageTimes& other) const {
    return {surface_s - other.surface_s, trace_s - other.trace_s, echo_s - other.echo_s,
            receive_s - other.receive_s};
  }
};

}  // namespace ensonify::engine
