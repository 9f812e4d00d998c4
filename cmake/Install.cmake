# Install.cmake: headers, libraries, find_package(Veduta), pkg-config.
include(CMakePackageConfigHelpers)

install(TARGETS ${veduta_installed} EXPORT VedutaTargets
        LIBRARY DESTINATION ${CMAKE_INSTALL_LIBDIR}
        ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR})
install(DIRECTORY include/veduta DESTINATION ${CMAKE_INSTALL_INCLUDEDIR})
install(EXPORT VedutaTargets NAMESPACE Veduta:: DESTINATION ${CMAKE_INSTALL_LIBDIR}/cmake/Veduta)
configure_package_config_file(cmake/VedutaConfig.cmake.in ${PROJECT_BINARY_DIR}/VedutaConfig.cmake
        INSTALL_DESTINATION ${CMAKE_INSTALL_LIBDIR}/cmake/Veduta)
write_basic_package_version_file(${PROJECT_BINARY_DIR}/VedutaConfigVersion.cmake
        COMPATIBILITY SameMajorVersion)
install(FILES ${PROJECT_BINARY_DIR}/VedutaConfig.cmake
              ${PROJECT_BINARY_DIR}/VedutaConfigVersion.cmake
        DESTINATION ${CMAKE_INSTALL_LIBDIR}/cmake/Veduta)
foreach(library ${veduta_installed})
    configure_file(cmake/${library}.pc.in ${PROJECT_BINARY_DIR}/${library}.pc @ONLY)
    install(FILES ${PROJECT_BINARY_DIR}/${library}.pc DESTINATION ${CMAKE_INSTALL_LIBDIR}/pkgconfig)
endforeach()
