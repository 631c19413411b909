#include <ensonify/engine/seafloor/bed/unmarked_grid.h>

#include <system_error>

#include <cpl_vsi.h>
#include <fmt/format.h>

#include <ensonify/refine/read_file.h>

namespace ensonify::engine {
namespace {

constexpr std::size_t mark_bytes = 3;

void put_into_memory(const std::string& name, std::string& content, std::size_t from) {
  VSILFILE* const file = VSIFileFromMemBuffer(
      name.c_str(), reinterpret_cast<GByte*>(content.data() + from), content.size() - from, FALSE);
  if (file) VSIFCloseL(file);
}

}  // namespace

UnmarkedGrid::UnmarkedGrid(const std::filesystem::path& file)
    : file_(file),
      text_(refine::read_file(file)),
      name_(fmt::format("/vsimem/ensonify-{}/grid.asc", fmt::ptr(this))),
      reference_name_(fmt::format("/vsimem/ensonify-{}/grid.prj", fmt::ptr(this))) {
  put_into_memory(name_, text_, mark_bytes);
  for (const char* extension : {".PRJ", ".prj"}) {
    std::filesystem::path reference_file = file;
    std::error_code not_there;
    if (std::filesystem::is_regular_file(reference_file.replace_extension(extension), not_there))
      reference_file_ = reference_file;
  }
  if (reference_file_.empty()) return;
  reference_ = refine::read_file(reference_file_);
  put_into_memory(reference_name_, reference_, 0);
}

UnmarkedGrid::~UnmarkedGrid() {
  VSIUnlink(name_.c_str());
  VSIUnlink(reference_name_.c_str());
}

std::filesystem::path UnmarkedGrid::original(const std::string& copy) const {
  return copy == reference_name_ ? reference_file_ : file_;
}

}  // namespace ensonify::engine
