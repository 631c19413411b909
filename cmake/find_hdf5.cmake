# Sets ENSONIFY_HDF5_FOUND, and makes the target PkgConfig::ENSONIFY_HDF5 of HDF5's C library. For
# pkg-config it is hdf5-serial on Debian and hdf5 elsewhere; where pkg-config does not know it, CMake
# searches by itself.
pkg_search_module(ENSONIFY_HDF5 QUIET IMPORTED_TARGET hdf5-serial hdf5)
if(NOT ENSONIFY_HDF5_FOUND)
  enable_language(C)  # it compiles C
  find_package(HDF5 QUIET COMPONENTS C)
  if(HDF5_FOUND)
    set(ENSONIFY_HDF5_FOUND ON)
    add_library(PkgConfig::ENSONIFY_HDF5 INTERFACE IMPORTED)
    target_link_libraries(PkgConfig::ENSONIFY_HDF5 INTERFACE hdf5::hdf5)
  endif()
endif()
