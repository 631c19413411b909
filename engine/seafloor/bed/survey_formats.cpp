#include <ensonify/engine/seafloor/bed/survey_formats.h>

#include <algorithm>
#include <cstddef>
#include <memory>
#include <regex>

#include <cpl_conv.h>
#include <cpl_string.h>
#include <cpl_vsi.h>
#include <fmt/format.h>
#include <gdal_priv.h>
#include <ogr_spatialref.h>

#include <ensonify/engine/base/lower_case.h>
#include <ensonify/engine/seafloor/bed/refuse_file.h>
#include <ensonify/refine/mesh_reader.h>
#include <ensonify/refine/progressive_mesh_file.h>
#include <ensonify/refine/read_file.h>

namespace ensonify::engine {
namespace {

/// The name of a type in numpy (without the byte order) and in GDAL, and its size.
struct NumberType {
  std::string_view numpy, gdal;
  std::uint64_t bytes;
};
constexpr std::array number_types = {NumberType{"f8", "Float64", 8}, NumberType{"f4", "Float32", 4},
                                     NumberType{"i4", "Int32", 4},   NumberType{"u4", "UInt32", 4},
                                     NumberType{"i2", "Int16", 2},   NumberType{"u2", "UInt16", 2},
                                     NumberType{"u1", "Byte", 1}};

}  // namespace

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

std::string vrt_of_npy(const std::filesystem::path& file, double cell_m) {
  // The file begins with magic, version, length of the header in 2 bytes (4 from version 2), and a
  // dictionary.
  constexpr std::uint64_t longest = 4096;  // numpy writes headers of about 80 bytes
  std::string header = refine::begin_of_file(file, 12 + longest);
  const std::size_t found = header.size();
  header.resize(12 + longest);
  const std::size_t length_bytes = header[6] == 1 ? 2 : 4, header_begin = 8 + length_bytes;
  std::uint64_t header_size = 0;
  for (std::size_t i = 0; i < length_bytes; ++i)
    header_size |= std::uint64_t{static_cast<unsigned char>(header[8 + i])} << (8 * i);
  const bool is_whole = header_size <= longest && header_begin + header_size <= found;
  header = header.substr(header_begin, is_whole ? header_size : 0);
  const std::regex type_item(R"('descr': *'([<>|=])(\w+)')"),
      order_item(R"('fortran_order': *(True|False))"),
      shape_item(R"('shape': *\((\d{1,10}), *(\d{1,10})\))");
  std::smatch type, order, shape;
  if (!is_whole || !std::regex_search(header, order, order_item))
    refuse_file(file,
                "has no whole header of an .npy file; save the heights again with numpy.save()");
  if (!std::regex_search(header, shape, shape_item))
    refuse_file(file,
                "does not hold an array of two dimensions, expected rows and columns of heights");
  const NumberType* number = nullptr;
  if (std::regex_search(header, type, type_item))
    for (const NumberType& one : number_types)
      if (type[2].str() == one.numpy) number = &one;
  if (!number)
    refuse_file(file, "holds no numbers that are read; save the heights as float64 or float32");
  const std::uint64_t rows = std::stoull(shape[1]), columns = std::stoull(shape[2]),
                      offset = header_begin + header_size,
                      promised = offset + rows * columns * number->bytes;
  constexpr std::uint64_t most = 1u << 30;
  if (rows > most || columns > most || promised != std::filesystem::file_size(file))
    refuse_file(file,
                fmt::format("has {} bytes where its header promises {} x {} numbers of {}; it is "
                            "truncated or damaged",
                            std::filesystem::file_size(file), rows, columns, number->bytes));
  const bool by_columns = order[1].str() == "True";
  const std::unique_ptr<char, void (*)(void*)> name(
      CPLEscapeString(std::filesystem::absolute(file).c_str(), -1, CPLES_XML), VSIFree);
  return fmt::format(
      R"(<VRTDataset rasterXSize="{columns}" rasterYSize="{rows}">
<GeoTransform>{west}, {cell}, 0, {south}, 0, {cell}</GeoTransform>
<VRTRasterBand dataType="{type}" band="1" subClass="VRTRawRasterBand">
<SourceFilename relativeToVRT="0">{name}</SourceFilename>
<ImageOffset>{offset}</ImageOffset><PixelOffset>{pixel}</PixelOffset><LineOffset>{line}</LineOffset>
<ByteOrder>{order}</ByteOrder>
</VRTRasterBand></VRTDataset>)",
      fmt::arg("columns", columns), fmt::arg("rows", rows),
      fmt::arg("west", -0.5 * static_cast<double>(columns) * cell_m), fmt::arg("cell", cell_m),
      fmt::arg("south", -0.5 * static_cast<double>(rows) * cell_m), fmt::arg("type", number->gdal),
      fmt::arg("name", name.get()), fmt::arg("offset", offset),
      fmt::arg("pixel", number->bytes * (by_columns ? rows : 1)),
      fmt::arg("line", number->bytes * (by_columns ? 1 : columns)),
      fmt::arg("order", type[1].str() == ">" ? "MSB" : "LSB"));
}

}  // namespace ensonify::engine
