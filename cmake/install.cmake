# Installation for find_package(ensonify), and two packages: the program with the Python module, and
# the libraries with their headers.
include(GNUInstallDirs)
include(CMakePackageConfigHelpers)
set(package_folder ${CMAKE_INSTALL_LIBDIR}/cmake/ensonify)

install(TARGETS ensonify RUNTIME COMPONENT program)
install(TARGETS ensonify_scatter ensonify_refine ensonify_engine EXPORT ensonify
        ARCHIVE COMPONENT development
        FILE_SET HEADERS COMPONENT development)
install(EXPORT ensonify NAMESPACE ensonify:: FILE ensonify-targets.cmake
        DESTINATION ${package_folder} COMPONENT development)
configure_package_config_file(cmake/ensonify-config.cmake.in ensonify-config.cmake
                              INSTALL_DESTINATION ${package_folder})
write_basic_package_version_file(ensonify-config-version.cmake COMPATIBILITY SameMinorVersion)
install(FILES ${CMAKE_CURRENT_BINARY_DIR}/ensonify-config.cmake
              ${CMAKE_CURRENT_BINARY_DIR}/ensonify-config-version.cmake
        DESTINATION ${package_folder} COMPONENT development)

if(PROJECT_IS_TOP_LEVEL)
  set(CPACK_GENERATOR DEB TGZ)
  set(CPACK_PACKAGE_NAME ensonify)
  set(CPACK_PACKAGE_CONTACT "the ensonify maintainers")
  set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
  set(CPACK_RESOURCE_FILE_LICENSE ${CMAKE_SOURCE_DIR}/LICENSE)
  set(CPACK_STRIP_FILES ON)
  set(CPACK_COMPONENTS_ALL program development)
  set(CPACK_DEB_COMPONENT_INSTALL ON)
  set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
  set(CPACK_DEBIAN_PACKAGE_SECTION science)
  set(CPACK_DEBIAN_PROGRAM_PACKAGE_NAME ensonify)
  set(CPACK_DEBIAN_PROGRAM_PACKAGE_SHLIBDEPS ON)
  set(CPACK_DEBIAN_PROGRAM_PACKAGE_RECOMMENDS python3-numpy)
  set(CPACK_COMPONENT_PROGRAM_DESCRIPTION
      "The program and its Python module: from a scene file to sidescan images.")
  set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_NAME libensonify-dev)
  set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_DEPENDS
      "libembree-dev, libopenmesh-dev, libtbb-dev, libeigen3-dev, libfmt-dev, libfftw3-dev, librandom123-dev, libgdal-dev, libhdf5-dev, libgeographiclib-dev, libopenexr-dev, libpng-dev, libarchive-dev, libxxhash-dev, libhwy-dev, nlohmann-json3-dev, libtomlplusplus-dev, pkg-config")
  set(CPACK_COMPONENT_DEVELOPMENT_DESCRIPTION "Headers and static libraries of ensonify.")
  include(CPack)
endif()
