#include <ensonify/engine/seafloor/bed/unmarked_grid.h>

#include <cpl_vsi.h>
#include <fmt/format.h>

#include <ensonify/refine/read_file.h>
#include <ensonify/refine/triangle_mesh.h>

namespace ensonify::engine {

UnmarkedGrid::UnmarkedGrid(const std::filesystem::path& file,
                           std::span<const std::filesystem::path> files_beside) {
  const std::string stem = file.stem().string();
  add(file, stem);
  for (const std::filesystem::path& beside : files_beside) add(beside, stem);
}

/// `stem` is the stem of the grid's name, with which the names of the files beside it also begin.
void UnmarkedGrid::add(const std::filesystem::path& file, const std::string& stem) {
  constexpr std::string_view mark = "\xef\xbb\xbf";
  copies_.push_back({.name = fmt::format("/vsimem/ensonify-{}/grid{}", fmt::ptr(this),
                                         file.filename().string().substr(stem.size())),
                     .content = refine::read_user_file<refine::MeshError>(file)});
  Copy& copy = copies_.back();
  const std::size_t begin = copy.content.starts_with(mark) ? mark.size() : 0;
  VSILFILE* const opened =
      VSIFileFromMemBuffer(copy.name.c_str(), reinterpret_cast<GByte*>(copy.content.data() + begin),
                           copy.content.size() - begin, FALSE);
  if (opened) VSIFCloseL(opened);
}

UnmarkedGrid::~UnmarkedGrid() {
  for (const Copy& copy : copies_) VSIUnlink(copy.name.c_str());
}

}  // namespace ensonify::engine
