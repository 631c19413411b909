#include <ensonify/engine/seafloor/bed/survey_formats.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <system_error>

#include <cpl_minixml.h>
#include <fmt/format.h>
#include <gdal_priv.h>

#include <ensonify/engine/base/untrusted.h>
#include <ensonify/engine/seafloor/bed/files_beside.h>
#include <ensonify/engine/seafloor/bed/refuse_file.h>
#include <ensonify/engine/seafloor/bed/survey_checks.h>
#include <ensonify/refine/read_file.h>
#include <ensonify/refine/triangle_mesh.h>

namespace ensonify::engine {
namespace {

constexpr std::uintmax_t most_mosaic_bytes = 1 << 26;  // enough for about 100,000 sources

class SurveyMosaic {
 public:
  explicit SurveyMosaic(const std::filesystem::path& file) : file_(file) {
    const std::unique_ptr<CPLXMLNode, void (*)(CPLXMLNode*)> tree(
        CPLParseXMLString(
            refine::read_user_file<refine::MeshError>(file, most_mosaic_bytes).c_str()),
        CPLDestroyXMLNode);
    if (!tree) fail("is not a whole VRT file");
    const CPLXMLNode* const root = CPLGetXMLNode(tree.get(), "=VRTDataset");
    if (!root) fail("is not a whole VRT file");
    look_at(*root);
    if (sources_.empty()) fail("names no file with heights");
  }
  const std::vector<std::filesystem::path>& sources() const { return sources_; }

 private:
  [[noreturn]] void fail(const std::string& what) const { refuse_file(file_, what); }

  void look_at(const CPLXMLNode& node) {
    constexpr std::array<std::string_view, 7> refused = {
        "VRTDataset",        "subClass",        "SourceDataset",    "OpenOptions",
        "PixelFunctionType", "GDALWarpOptions", "PixelFunctionCode"};
    for (const CPLXMLNode* child = node.psChild; child; child = child->psNext) {
      const std::string_view name = child->pszValue;
      if (child->eType == CXT_Text) continue;
      if (std::ranges::find(refused, name) != refused.end())
        fail(
            fmt::format("has the VRT element '{}'; only mosaics of local files are read: make a "
                        "GeoTIFF of it with gdal_translate",
                        name));
      if (name == "SourceFilename") take_source(*child);
      look_at(*child);
    }
  }

  void take_source(const CPLXMLNode& node) {
    const std::filesystem::path named = CPLGetXMLValue(&node, nullptr, "");
    const bool beside = std::string_view(CPLGetXMLValue(&node, "relativeToVRT", "0")) == "1";
    const std::filesystem::path place =
        beside ? std::filesystem::absolute(file_).parent_path() / named : named;
    std::error_code error;
    if (named.empty() || !std::filesystem::is_regular_file(place, error))
      fail(fmt::format("names '{}', which is no local file; only mosaics of local files are read",
                       named.string()));
    // Like a scene, a mosaic may only name files in its folder or below it.
    if (!lies_below(place, std::filesystem::absolute(file_).parent_path()))
      fail(
          fmt::format("names '{}', which does not lie in its own folder or below it; put the files "
                      "there",
                      named.string()));
    if (const std::string fault = refine::fault_of_file(place); !fault.empty())
      refuse_file(place, fault);
    if (!GDALIdentifyDriverEx(place.c_str(), GDAL_OF_RASTER, survey_drivers.data(), nullptr))
      fail(
          fmt::format("names '{}', which is no GeoTIFF, BAG, ESRI ASCII grid or netCDF file; only "
                      "mosaics of local files of these formats are read",
                      named.string()));
    if (const FilesBeside beside(place); !beside.erdas_file().empty())
      refuse_file(beside.erdas_file(),
                  fmt::format("is an ERDAS file beside a part of {}, and can name other files; "
                              "remove it",
                              file_.filename().string()));
    if (is_hdf5(place))
      if (const std::string fault = fault_of_hdf5(place); !fault.empty()) refuse_file(place, fault);
    const std::unique_ptr<GDALDataset> source(
        GDALDataset::Open(std::filesystem::absolute(place).c_str(), GDAL_OF_RASTER,
                          survey_drivers.data(), nullptr, nullptr));
    if (source && has_refinements(*source))
      fail(
          fmt::format("names '{}', a BAG of variable resolution, of which a mosaic has the "
                      "overview alone; write it as a GeoTIFF with `ensonify seafloor`",
                      named.string()));
    if (source && names_overviews(*source))
      fail(
          fmt::format("names '{}', which names another file with its overviews; write it again "
                      "with gdal_translate",
                      named.string()));
    sources_.push_back(place);
  }

  const std::filesystem::path& file_;
  std::vector<std::filesystem::path> sources_;
};

}  // namespace

std::vector<std::filesystem::path> files_of_mosaic(const std::filesystem::path& file) {
  return SurveyMosaic(file).sources();
}

}  // namespace ensonify::engine
