#include "support/paths.h"

namespace ensonify::tests {

std::filesystem::path source_folder() { return ENSONIFY_SOURCE_DIR; }
std::filesystem::path program_file() { return ENSONIFY_PROGRAM; }
std::filesystem::path default_data_folder() { return ENSONIFY_DEFAULT_DATA; }

}  // namespace ensonify::tests
