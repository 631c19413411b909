#include <ensonify/engine/seafloor/bed/files_beside.h>

#include <array>
#include <cctype>
#include <cstdint>
#include <string>
#include <string_view>
#include <system_error>

#include <cpl_conv.h>
#include <cpl_error.h>
#include <cpl_minixml.h>
#include <fmt/format.h>
#include <gdal_priv.h>

#include <ensonify/engine/base/lower_case.h>
#include <ensonify/engine/base/untrusted.h>
#include <ensonify/engine/seafloor/bed/refuse_file.h>
#include <ensonify/engine/seafloor/bed/survey_formats.h>
#include <ensonify/refine/read_file.h>

namespace ensonify::engine {
namespace {

namespace fs = std::filesystem;

constexpr std::uintmax_t most_text_bytes = 1 << 20;
constexpr std::uintmax_t most_metadata_bytes = 1 << 24;  // they may have histograms and tables

/// The name of the GDAL driver that would open a file; empty if the file is no raster.
std::string driver_of(const fs::path& file) {
  if (!refine::fault_of_file(file).empty()) return {};
  if (is_hdf5(file)) return "HDF5";
  const std::string begin = refine::begin_of_file(file, 4);
  if (begin.starts_with("\xef\xbb\xbf"))  // a text grid, which UnmarkedGrid passes to GDAL
    return std::isalpha(static_cast<unsigned char>(begin.back())) ? "AAIGrid" : "";
  GDALAllRegister();
  constexpr std::array<const char*, 7> drivers = {"GTiff", "AAIGrid", "netCDF", "PNG",
                                                  "JPEG",  "VRT",     nullptr};
  const CPLErrorHandlerPusher quiet(CPLQuietErrorHandler);
  const GDALDriverH driver =
      GDALIdentifyDriverEx(fs::absolute(file).c_str(), GDAL_OF_RASTER, drivers.data(), nullptr);
  return driver ? GDALGetDriverShortName(driver) : "";
}

/// The use that GDAL makes of a file beside a raster.
enum class Role { none, metadata, mask, reference, place, overviews, erdas };

Role role_of(const fs::path& file, const fs::path& raster, std::string_view driver) {
  const std::string name = lower_case(file.filename().string());
  const std::string whole = lower_case(raster.filename().string());
  const std::string stem = lower_case(raster.stem().string());
  const bool is_mosaic = driver == "VRT";
  if (name == whole + ".msk") return Role::mask;
  if (name == whole + ".ovr") return Role::overviews;
  if (name == stem + ".aux" || name == whole + ".aux") return Role::erdas;
  if (name == whole + ".aux.xml" && !is_mosaic) return Role::metadata;
  if (name == stem + ".prj" && driver == "AAIGrid") return Role::reference;
  if (driver != "GTiff" && driver != "PNG" && driver != "JPEG") return Role::none;
  if (name == stem + ".tab" || name == stem + ".wld") return Role::place;
  // World files: for example .tfw and .tifw for .tif.
  const std::string ending = whole.substr(stem.size());
  if (ending.size() < 3) return Role::none;
  return name == stem + ending + "w" || name == stem + ending.substr(0, 2) + ending.back() + "w"
             ? Role::place
             : Role::none;
}

}  // namespace

FilesBeside::FilesBeside(const fs::path& raster) {
  const std::string driver = driver_of(raster);
  if (driver.empty()) return;
  const fs::path folder = fs::absolute(raster).parent_path();
  std::error_code unreadable;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder, unreadable)) {
    const fs::path& file = entry.path();
    const Role role = role_of(file, raster, driver);
    if (role == Role::none) continue;
    const auto refuse = [&](const std::string& what) {
      refuse_file(file, fmt::format("would be read with {}, which it lies beside, but {}",
                                    raster.filename().string(), what));
    };
    std::error_code error;
    const fs::file_status status = entry.status(error);
    const bool is_image = role == Role::mask || role == Role::overviews;
    if (!fs::exists(status)) continue;
    if (fs::is_directory(status) && !is_image) continue;  // GDAL does not open it
    if (!fs::is_regular_file(status)) refuse("is not a regular file; remove it");
    if (!lies_below(file, folder))
      refuse(fmt::format("is a link that leads out of {}; copy the file there", folder.string()));
    if (const std::string fault = refine::fault_of_file(file); !fault.empty()) refuse(fault);
    const bool is_text = role == Role::reference || role == Role::place;
    const std::uintmax_t most = is_text ? most_text_bytes : most_metadata_bytes;
    if (const std::uintmax_t bytes = entry.file_size();
        (is_text || role == Role::metadata) && bytes > most)
      refuse(fmt::format("has {} bytes, expected at most {}; remove it", bytes, most));
    if (is_image) {
      const std::string begin = refine::begin_of_file(file, 2);
      if (begin != "II" && begin != "MM")
        refuse("is no TIFF file; make one with gdal_translate -of GTiff, or remove it");
    }
    if (role == Role::metadata) {
      const std::string text = refine::read_user_file<refine::MeshError>(file, most);
      const CPLErrorHandlerPusher quiet(CPLQuietErrorHandler);
      const CPLXMLTreeCloser tree(CPLParseXMLString(text.c_str()));
      if (!tree.get() || !CPLGetXMLNode(tree.get(), "=PAMDataset"))
        refuse("is no whole metadata of GDAL (a PAMDataset); write it again, or remove it");
      has_metadata_ = true;
    }
    if (role == Role::erdas)
      erdas_file_ = file;
    else if (role != Role::overviews)
      read_.push_back(file);
  }
}

}  // namespace ensonify::engine
