#pragma once

#include <span>
#include <string_view>

namespace ensonify::engine {

/// A file of the page as it lies beside this one, put into the program when it is built.
struct PageFile {
  std::string_view path;  ///< "/page.css"
  std::string_view content;
};
std::span<const PageFile> page_files();

}  // namespace ensonify::engine
