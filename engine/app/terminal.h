#pragma once

#include <sys/ioctl.h>

#include <cstddef>

namespace ensonify::engine::app {

/// How many columns a terminal has; 80 where the file is no terminal.
inline std::size_t terminal_columns(int descriptor) {
  winsize size{};
  if (ioctl(descriptor, TIOCGWINSZ, &size) != 0 || size.ws_col == 0) return 80;
  return size.ws_col;
}

}  // namespace ensonify::engine::app
