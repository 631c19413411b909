#pragma once

#include <filesystem>

namespace ensonify::tests {

/// Where this build's sources, its program and (unless ENSONIFY_DATA says otherwise) the real data
/// lie. Defined beside main, so that the tests themselves compile alike in any folder.
std::filesystem::path source_folder();
std::filesystem::path program_file();
std::filesystem::path default_data_folder();

}  // namespace ensonify::tests
