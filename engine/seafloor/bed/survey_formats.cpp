#include <ensonify/engine/seafloor/bed/survey_formats.h>

#include <algorithm>
#include <memory>

#include <cpl_vsi.h>
#include <fmt/format.h>
#include <gdal_priv.h>
#include <ogr_spatialref.h>

#include <ensonify/engine/base/lower_case.h>
#include <ensonify/refine/mesh_reader.h>
#include <ensonify/refine/progressive_mesh_file.h>
#include <ensonify/refine/read_file.h>

namespace ensonify::engine {

bool is_hdf5(const std::filesystem::path& file) {
  return refine::begins_with(file, "\x89HDF\r\n\x1a\n");
}

bool is_mosaic(const std::filesystem::path& file) {
  return refine::begins_with(file, "<VRTDataset");
}

std::optional<SeafloorFile> seafloor_file(const std::filesystem::path& file) {
  if (refine::is_progressive_mesh(file)) return SeafloorFile{"a progressive mesh", "progressive"};
  if (refine::mesh_format(file)) return SeafloorFile{"a mesh", "mesh"};
  // In lower case: GeoTIFF (also BigTIFF) in both byte orders, netCDF, .npy, ESRI ASCII grid.
  constexpr std::array<std::string_view, 7> begins = {
      {{"ii*\0", 4}, {"ii+\0", 4}, {"mm\0*", 4}, {"mm\0+", 4}, "cdf", "\x93numpy", "ncols"}};
  const std::string begin = lower_case(refine::begin_of_file(file, 6));
  if (is_hdf5(file) || is_mosaic(file) ||
      std::ranges::any_of(begins, [&](std::string_view one) { return begin.starts_with(one); }))
    return SeafloorFile{"a survey grid", "survey"};
  return std::nullopt;
}

std::string fault_of_kind(const std::filesystem::path& file, const SeafloorFile& found,
                          std::string_view wanted) {
  return fmt::format(
      "{0}: is {1}, expected {2}; a scene takes it with kind = \"{3}\" and {3} = \"FILE\" in "
      "[seafloor]",
      file.string(), found.is, wanted, found.kind);
}

bool has_refinements(GDALDataset& dataset) {
  // GDAL copies the item into files that it makes from a BAG, so the driver is checked, too.
  if (std::string_view(dataset.GetDriverName()) != "BAG") return false;
  const char* const found = dataset.GetMetadataItem("HAS_SUPERGRIDS");
  return found && std::string_view(found) == "TRUE";
}

bool names_overviews(GDALDataset& dataset) {
  return dataset.GetMetadataItem("OVERVIEW_FILE", "OVERVIEWS") != nullptr;
}

std::string wkt_of(const OGRSpatialReference& reference) {
  // WKT2, because WKT1 cannot describe some systems.
  constexpr std::array<const char*, 2> options = {"FORMAT=WKT2", nullptr};
  char* text = nullptr;
  reference.exportToWkt(&text, options.data());
  const std::unique_ptr<char, void (*)(void*)> owned(text, VSIFree);
  return text ? text : "";
}

}  // namespace ensonify::engine
