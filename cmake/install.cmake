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
# The component `program` of find_package(), which needs more than the libraries do.
install(TARGETS ensonify_program ensonify_live EXPORT ensonify-program
        ARCHIVE COMPONENT development
        FILE_SET HEADERS COMPONENT development)
install(EXPORT ensonify-program NAMESPACE ensonify:: FILE ensonify-program-targets.cmake
        DESTINATION ${package_folder} COMPONENT development)
configure_package_config_file(cmake/ensonify-config.cmake.in ensonify-config.cmake
                              INSTALL_DESTINATION ${package_folder})
write_basic_package_version_file(ensonify-config-version.cmake COMPATIBILITY SameMinorVersion)
install(FILES ${CMAKE_CURRENT_BINARY_DIR}/ensonify-config.cmake
              ${CMAKE_CURRENT_BINARY_DIR}/ensonify-config-version.cmake
              cmake/find_hdf5.cmake
        DESTINATION ${package_folder} COMPONENT development)

install(FILES cmake/package/completion.bash RENAME ensonify
        DESTINATION ${CMAKE_INSTALL_DATADIR}/bash-completion/completions COMPONENT program)
file(GLOB example_files CONFIGURE_DEPENDS scenes/*.toml)
install(FILES ${example_files} DESTINATION ${CMAKE_INSTALL_DOCDIR}/examples COMPONENT program)
file(GLOB slurm_files CONFIGURE_DEPENDS scenes/slurm/*.sbatch)
install(FILES CHANGELOG.md DESTINATION ${CMAKE_INSTALL_DOCDIR} COMPONENT program)
install(FILES ${slurm_files} DESTINATION ${CMAKE_INSTALL_DOCDIR}/examples/slurm COMPONENT program)

# A manual page of the program and of each command, from their --help.
find_program(HELP2MAN help2man)
if(HELP2MAN)
  set(manual_folder ${PROJECT_BINARY_DIR}/man)
  set(manual_script ${CMAKE_CURRENT_LIST_DIR}/package/manual.sh)
  add_custom_command(OUTPUT ${manual_folder}/ensonify.1.gz
                     COMMAND bash ${manual_script} $<TARGET_FILE:ensonify> ${PROJECT_VERSION} ${manual_folder}
                     DEPENDS ensonify ${manual_script})
  add_custom_target(manual ALL DEPENDS ${manual_folder}/ensonify.1.gz)
  install(DIRECTORY ${manual_folder}/ DESTINATION ${CMAKE_INSTALL_MANDIR}/man1 COMPONENT program OPTIONAL)
endif()

if(PROJECT_IS_TOP_LEVEL)
  set(ENSONIFY_MAINTAINER "ensonify maintainers <maintainers@ensonify.invalid>" CACHE STRING
      "The maintainer that the Debian packages name")
  set(CPACK_GENERATOR DEB)
  set(CPACK_PACKAGE_NAME ensonify)
  set(CPACK_PACKAGE_CONTACT ${ENSONIFY_MAINTAINER})
  set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
  set(CPACK_RESOURCE_FILE_LICENSE ${PROJECT_SOURCE_DIR}/LICENSE)
  set(CPACK_STRIP_FILES ON)
  set(CPACK_COMPONENTS_ALL program development)
  set(CPACK_DEB_COMPONENT_INSTALL ON)
  set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
  set(CPACK_DEBIAN_PACKAGE_SECTION science)
  set(CPACK_DEBIAN_PROGRAM_PACKAGE_NAME ensonify)
  set(CPACK_DEBIAN_PROGRAM_PACKAGE_SHLIBDEPS ON)
  math(EXPR next_python_minor "${Python_VERSION_MINOR} + 1")
  set(CPACK_DEBIAN_PROGRAM_PACKAGE_DEPENDS
      "python3 (>= ${Python_VERSION_MAJOR}.${Python_VERSION_MINOR}), python3 (<< ${Python_VERSION_MAJOR}.${next_python_minor})")
  set(CPACK_DEBIAN_PROGRAM_PACKAGE_RECOMMENDS python3-numpy)
  set(CPACK_PACKAGE_DESCRIPTION_SUMMARY "sidescan sonar simulated by ray tracing")
  set(CPACK_COMPONENT_PROGRAM_DESCRIPTION
      "From a scene file to sidescan images, with the truth of every pixel:
seabeds, objects, calibrated echo levels, labels and datasets.
The Python module does the same.")
  set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_NAME libensonify-dev)
  set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_SECTION libdevel)
  set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_DEPENDS
      "libembree-dev, libopenmesh-dev, libtbb-dev, libeigen3-dev, libfmt-dev, libfftw3-dev, librandom123-dev, libgdal-dev, libhdf5-dev, libgeographiclib-dev, libopenexr-dev, libpng-dev, libarchive-dev, libxxhash-dev, libhwy-dev, nlohmann-json3-dev, libtomlplusplus-dev, pkg-config")
  set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_RECOMMENDS "libcpp-httplib-dev, libssl-dev")  # of ensonify::program
  set(CPACK_COMPONENT_DEVELOPMENT_DESCRIPTION
      "Headers and static libraries: find_package(ensonify) in CMake.")
  # What Debian asks of every package.
  string(TIMESTAMP package_date "%a, %d %b %Y %H:%M:%S +0000" UTC)
  configure_file(cmake/package/changelog.in changelog @ONLY)
  execute_process(COMMAND gzip -9nc ${PROJECT_BINARY_DIR}/changelog
                  OUTPUT_FILE ${PROJECT_BINARY_DIR}/changelog.gz)
  foreach(package ensonify:program libensonify-dev:development)
    string(REPLACE ":" ";" package ${package})
    list(GET package 0 name)
    list(GET package 1 component)
    install(FILES cmake/package/copyright ${PROJECT_BINARY_DIR}/changelog.gz
            DESTINATION ${CMAKE_INSTALL_DATADIR}/doc/${name} COMPONENT ${component}
            EXCLUDE_FROM_ALL)
  endforeach()
  include(CPack)
endif()
