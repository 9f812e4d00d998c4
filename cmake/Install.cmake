# Install.cmake: headers, libraries, find_package(Veduta), pkg-config.
include(CMakePackageConfigHelpers)

install(TARGETS ${veduta_installed} EXPORT VedutaTargets
        LIBRARY DESTINATION ${CMAKE_INSTALL_LIBDIR}
        ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR})
# geo.h belongs to veduta-io, model_import.h to veduta-model, snapshot.h to veduta-snapshot, text.h to
# veduta-text, client.h, codec.h, server.h and wire.h to veduta-remote: they go where those go.
set(veduta_left_out)
if(NOT VEDUTA_GEO)
    list(APPEND veduta_left_out PATTERN geo.h EXCLUDE)
endif()
if(NOT VEDUTA_MODEL)
    list(APPEND veduta_left_out PATTERN model_import.h EXCLUDE)
endif()
if(NOT VEDUTA_HDF5)
    list(APPEND veduta_left_out PATTERN snapshot.h EXCLUDE)
endif()
if(NOT VEDUTA_TEXT)
    list(APPEND veduta_left_out PATTERN text.h EXCLUDE)
endif()
if(NOT VEDUTA_REMOTE)
    list(APPEND veduta_left_out PATTERN client.h EXCLUDE PATTERN codec.h EXCLUDE PATTERN server.h EXCLUDE PATTERN wire.h EXCLUDE)
endif()
install(DIRECTORY include/veduta DESTINATION ${CMAKE_INSTALL_INCLUDEDIR} ${veduta_left_out})

# The page, where script/build-web made it.
if(VEDUTA_APP)
    install(DIRECTORY web/dist/ DESTINATION ${CMAKE_INSTALL_DATADIR}/veduta/web OPTIONAL)
endif()

# ---- find_package(Veduta) ------------------------------------------------------------------------
set(veduta_cmake_dir ${CMAKE_INSTALL_LIBDIR}/cmake/Veduta)
install(EXPORT VedutaTargets NAMESPACE Veduta:: DESTINATION ${veduta_cmake_dir})
configure_package_config_file(cmake/VedutaConfig.cmake.in ${PROJECT_BINARY_DIR}/VedutaConfig.cmake
        INSTALL_DESTINATION ${veduta_cmake_dir})
write_basic_package_version_file(${PROJECT_BINARY_DIR}/VedutaConfigVersion.cmake
        COMPATIBILITY SameMajorVersion)
install(FILES ${PROJECT_BINARY_DIR}/VedutaConfig.cmake
              ${PROJECT_BINARY_DIR}/VedutaConfigVersion.cmake
        DESTINATION ${veduta_cmake_dir})

# ---- pkg-config ----------------------------------------------------------------------------------
# The paths are relative to the .pc file, so that an installed tree can be moved, and `cmake
# --install --prefix` can put it elsewhere than was configured.
file(RELATIVE_PATH veduta_pc_prefix
     ${CMAKE_INSTALL_FULL_LIBDIR}/pkgconfig ${CMAKE_INSTALL_PREFIX})
file(RELATIVE_PATH veduta_pc_libdir ${CMAKE_INSTALL_PREFIX} ${CMAKE_INSTALL_FULL_LIBDIR})
file(RELATIVE_PATH veduta_pc_includedir ${CMAKE_INSTALL_PREFIX} ${CMAKE_INSTALL_FULL_INCLUDEDIR})
set(veduta_pc_websockets)
if(WEBSOCKETS_FOUND)
    set(veduta_pc_websockets "libwebsockets openssl")
endif()
set(veduta_pc_requires_private "spng libxxhash")
if(DEFLATE_FOUND)
    string(APPEND veduta_pc_requires_private " libdeflate")
endif()
set(veduta_pc_libs_private "-lm -pthread")
if(OPENEXR_CORE_LIBRARY)
    get_filename_component(openexr_name ${OPENEXR_CORE_LIBRARY} NAME_WE)
    string(REGEX REPLACE "^lib" "-l" openexr_name ${openexr_name})
    string(PREPEND veduta_pc_libs_private "${openexr_name} ")
endif()
if(JPEG_FOUND)
    string(APPEND veduta_pc_requires_private " libjpeg")
endif()
foreach(library ${veduta_installed})
    configure_file(cmake/${library}.pc.in ${PROJECT_BINARY_DIR}/${library}.pc @ONLY)
    install(FILES ${PROJECT_BINARY_DIR}/${library}.pc DESTINATION ${CMAKE_INSTALL_LIBDIR}/pkgconfig)
endforeach()
