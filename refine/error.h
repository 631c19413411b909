#pragma once

#include <stdexcept>

namespace ensonify {

/// The base of every exception that the libraries define; engine/README.md lists them. It is
/// defined in the lowest of these libraries. Wrong arguments of a call are std::invalid_argument,
/// files that cannot be written std::system_error.
struct Error : std::runtime_error {
  using std::runtime_error::runtime_error;
};

}  // namespace ensonify
