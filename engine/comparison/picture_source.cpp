#include <ensonify/engine/comparison/picture_source.h>

#include <algorithm>
#include <array>
#include <memory>
#include <string>

#include <cpl_conv.h>
#include <cpl_error.h>
#include <fmt/format.h>
#include <gdal_priv.h>

#include <ensonify/engine/base/lower_case.h>
#include <ensonify/engine/recording/recording_reader.h>
#include <ensonify/engine/seafloor/bed/files_beside.h>
#include <ensonify/refine/read_file.h>

namespace ensonify::engine {
namespace {

namespace fs = std::filesystem;

constexpr double max_pixels = 268435456.0;  // 2^28, in all pictures together

/// Appends the rows of a picture from the bottom up, so that the oldest ping is first. Each row is
/// divided into sides at its middle.
void add_picture(const fs::path& file, RecordedLine& line) {
  [[maybe_unused]] static const bool registered = (GDALAllRegister(), true);
  refine::require_file<RecordingError>(file);
  const FilesBeside checked(file);
  constexpr std::array<const char*, 3> drivers = {"PNG", "JPEG", nullptr};
  const std::unique_ptr<GDALDataset> picture(GDALDataset::Open(fs::absolute(file).c_str(),
                                                               GDAL_OF_RASTER | GDAL_OF_READONLY,
                                                               drivers.data(), nullptr, nullptr));
  const auto fail = [&](const std::string& what) {
    throw RecordingError(fmt::format("{}: {}", file.string(), what));
  };
  if (!picture) fail("cannot be read as a PNG or JPEG picture");
  const int columns = picture->GetRasterXSize(), rows = picture->GetRasterYSize();
  const std::size_t half = static_cast<std::size_t>(columns) / 2;
  const double pixels = static_cast<double>(columns) * (rows + double(line.pings.size()));
  if (half < 1 || pixels > max_pixels) fail("expected 2 columns or more, 2^28 pixels at most");
  if (line.samples != 0 && half != line.samples)
    fail(fmt::format("is {} pixels wide, and those before it {}; expected pictures of one width",
                     columns, 2 * line.samples));
  line.samples = half;
  const int channels = std::min(picture->GetRasterCount(), 3);  // without the channel of opacity
  std::vector<float> row(static_cast<std::size_t>(columns)), channel(row.size());
  for (int r = rows - 1; r >= 0; --r) {
    std::ranges::fill(row, 0.0f);
    for (int k = 1; k <= channels; ++k) {
      if (picture->GetRasterBand(k)->RasterIO(GF_Read, 0, r, columns, 1, channel.data(), columns, 1,
                                              GDT_Float32, 0, 0, nullptr) != CE_None)
        fail(fmt::format("row {} of {} cannot be read; the file is damaged", r + 1, rows));
      for (std::size_t i = 0; i < row.size(); ++i)
        row[i] += channel[i] / static_cast<float>(channels);
    }
    line.pings.push_back({.number = line.pings.size(), .samples = half});
    const auto middle = row.begin() + static_cast<std::ptrdiff_t>(half);
    line.port.insert(line.port.end(), std::make_reverse_iterator(middle), row.rend());
    line.starboard.insert(line.starboard.end(), row.end() - static_cast<std::ptrdiff_t>(half),
                          row.end());
  }
}

}  // namespace

std::vector<fs::path> pictures_of(const fs::path& folder) {
  std::vector<fs::path> files;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder)) {
    const std::string ending = lower_case(entry.path().extension().string());
    if (entry.is_regular_file() && (ending == ".png" || ending == ".jpg" || ending == ".jpeg"))
      files.push_back(entry.path());
  }
  std::ranges::sort(files);
  return files;
}

RecordedLine line_of_pictures(const fs::path& folder) {
  const CPLErrorHandlerPusher quiet(CPLQuietErrorHandler);
  const CPLConfigOptionSetter no_sidecars("GDAL_PAM_ENABLED", "NO", false);
  RecordedLine line{.format = "pictures"};
  for (const fs::path& file : pictures_of(folder)) add_picture(file, line);
  return line;
}

}  // namespace ensonify::engine
