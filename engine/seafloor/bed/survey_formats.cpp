#include <ensonify/engine/seafloor/bed/survey_formats.h>

#include <memory>

#include <cpl_vsi.h>
#include <gdal_priv.h>
#include <ogr_spatialref.h>

#include <ensonify/refine/read_file.h>

namespace ensonify::engine {

bool is_hdf5(const std::filesystem::path& file) {
  return refine::begins_with(file, "\x89HDF\r\n\x1a\n");
}

bool is_mosaic(const std::filesystem::path& file) {
  return refine::begins_with(file, "<VRTDataset");
}

bool has_refinements(GDALDataset& dataset) {
  // GDAL copies the item into what it makes of a BAG.
  if (std::string_view(dataset.GetDriverName()) != "BAG") return false;
  const char* const found = dataset.GetMetadataItem("HAS_SUPERGRIDS");
  return found && std::string_view(found) == "TRUE";
}

std::string wkt_of(const OGRSpatialReference& reference) {
  // WKT1 lacks some systems.
  constexpr std::array<const char*, 2> options = {"FORMAT=WKT2", nullptr};
  char* text = nullptr;
  reference.exportToWkt(&text, options.data());
  const std::unique_ptr<char, void (*)(void*)> owned(text, VSIFree);
  return text ? text : "";
}

}  // namespace ensonify::engine
