#pragma once

#include <sys/ioctl.h>

#include <cstddef>

namespace ensonify::engine::app {

/// The number of columns of a terminal; 80 if the file is not a terminal.
inline std::size_t terminal_columns(int descriptor) {
  winsize size{};
  if (ioctl(descriptor, TIOCGWINSZ, &size) != 0 || size.ws_col == 0) return 80;
  return size.ws_col;
}

}  // namespace ensonify::engine::app
