#pragma once

#include <stdexcept>

namespace ensonify {

/// The base of every exception that the libraries define; engine/README.md lists them. It is in the
/// lowest library, so that all can use it. A wrong argument of a call is a std::invalid_argument,
/// and a file that cannot be written is a std::system_error.
struct Error : std::runtime_error {
  using std::runtime_error::runtime_error;
};

}  // namespace ensonify
