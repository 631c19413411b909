#pragma once

#include <filesystem>

namespace ensonify::tests {

/// The folders of this build's sources, its program and (unless ENSONIFY_DATA is set) the real
/// data. Defined in paths.cpp, so that the tests compile to the same objects in any folder.
std::filesystem::path source_folder();
std::filesystem::path program_file();
std::filesystem::path default_data_folder();

}  // namespace ensonify::tests
