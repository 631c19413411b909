#pragma once

#include <string_view>

namespace ensonify::engine {

/// The page's files as they lie beside this one, put into the program when it is built.
extern const std::string_view page_html, page_css, page_js;

}  // namespace ensonify::engine
