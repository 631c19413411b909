#include <ensonify/engine/seafloor/bed/survey_formats.h>

#include <fstream>
#include <memory>

#include <cpl_vsi.h>
#include <gdal_priv.h>
#include <ogr_spatialref.h>

namespace ensonify::engine {

bool begins_with(const std::filesystem::path& file, std::string_view begin) {
  std::string found(begin.size(), '\0');
  std::ifstream in(file, std::ios::binary);
  in.read(found.data(), static_cast<std::streamsize>(found.size()));
  return found == begin;
}

bool is_hdf5(const std::filesystem::path& file) { return begins_with(file, "\x89HDF\r\n\x1a\n"); }

bool is_mosaic(const std::filesystem::path& file) { return begins_with(file, "<VRTDataset"); }

bool has_refinements(GDALDataset& dataset) {
  // GDAL copies the item into what it makes of a BAG.
  if (std::string_view(dataset.GetDriverName()) != "BAG") return false;
  const char* const found = dataset.GetMetadataItem("HAS_SUPERGRIDS");
  return found && std::string_view(found) == "TRUE";
}

std::string wkt_of(const OGRSpatialReference& reference) {
  constexpr std::array<const char*, 2> options = {"FORMAT=WKT2", nullptr};  // 1 lacks some systems
  char* text = nullptr;
  reference.exportToWkt(&text, options.data());
  const std::unique_ptr<char, void (*)(void*)> owned(text, VSIFree);
  return text ? text : "";
}

}  // namespace ensonify::engine
