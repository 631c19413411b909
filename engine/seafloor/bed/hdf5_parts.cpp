#include <ensonify/engine/seafloor/bed/hdf5_parts.h>

#include <fmt/format.h>

#include <ensonify/engine/seafloor/bed/hdf5_handle-inl.h>

namespace ensonify::engine {
namespace {

/// For H5Lvisit(): returns 1, which ends the visit, at a link or a table whose content is in
/// another file, and sets `found` to its name.
herr_t is_elsewhere(hid_t group, const char* name, const H5L_info_t* link, void* found) {
  bool elsewhere = link->type == H5L_TYPE_EXTERNAL;
  if (link->type == H5L_TYPE_HARD) {
    const Hdf5Handle object(H5Oopen(group, name, H5P_DEFAULT), H5Oclose);
    if (object.is_open() && H5Iget_type(object.get()) == H5I_DATASET) {
      const Hdf5Handle made_with(H5Dget_create_plist(object.get()), H5Pclose);
      elsewhere = made_with.is_open() && (H5Pget_external_count(made_with.get()) > 0 ||
                                          H5Pget_layout(made_with.get()) == H5D_VIRTUAL);
    }
  }
  if (elsewhere) *static_cast<std::string*>(found) = name;
  return elsewhere ? 1 : 0;
}

}  // namespace

std::string fault_of_hdf5(const std::filesystem::path& file) {
  const Hdf5Handle all(H5Fopen(file.c_str(), H5F_ACC_RDONLY, H5P_DEFAULT), H5Fclose);
  std::string found;
  if (all.is_open()) H5Lvisit(all.get(), H5_INDEX_NAME, H5_ITER_NATIVE, is_elsewhere, &found);
  if (found.empty()) return {};
  return fmt::format(
      "has the content of '{}' in another file; put it into this one (h5repack, or "
      "gdal_translate to a GeoTIFF)",
      found);
}

}  // namespace ensonify::engine
