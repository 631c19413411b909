#pragma once

#include <stdexcept>

namespace ensonify {

/// The base of every exception that the libraries define: SceneError, refine::MeshError and
/// refine::DamagedFile, MemoryError, Stopped. It stands on the lowest floor that throws one. Wrong
/// arguments of a call are std::invalid_argument, files that cannot be written std::system_error.
struct Error : std::runtime_error {
  using std::runtime_error::runtime_error;
};

}  // namespace ensonify
