#pragma once

#include <span>
#include <string_view>

namespace ensonify::engine {

/// A file of the page, from this folder, embedded into the program when it is built.
struct PageFile {
  std::string_view path;  ///< "/page.css"
  std::string_view content;
};
std::span<const PageFile> page_files();

}  // namespace ensonify::engine
