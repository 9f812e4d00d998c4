# Helpers.cmake: how a room's sources become part of a library.

# veduta_room_sources(OUT ROOM…): the sources of the rooms under src/.
# A file named *_v2.c, *_v3.c or *_v4.c is a SIMD level's copy of a kernel and is compiled for it.
function(veduta_room_sources out)
    set(all)
    foreach(room ${ARGN})
        file(GLOB sources CONFIGURE_DEPENDS ${PROJECT_SOURCE_DIR}/src/${room}/*.c)
        list(APPEND all ${sources})
    endforeach()
    if(CMAKE_SYSTEM_PROCESSOR MATCHES "x86_64|AMD64|amd64")
        foreach(source ${all})
            if(source MATCHES "_(v[234])\\.c$")
                set_source_files_properties(${source} PROPERTIES COMPILE_OPTIONS
                                            "-march=x86-64-${CMAKE_MATCH_1};-O3")
            endif()
        endforeach()
    else()
        list(FILTER all EXCLUDE REGEX "_(v[34])\\.c$")
    endif()
    set(${out} ${all} PARENT_SCOPE)
endfunction()

# veduta_flags(TARGET): the flags of every C file here. No contraction: a*b+c must round twice on
# every machine, or pictures differ between processors.
function(veduta_flags target)
    target_compile_options(${target} PRIVATE -ffp-contract=off -Wall -Wextra -Wno-psabi
                           -Wstrict-prototypes -Wmissing-prototypes -Wshadow)
    target_compile_definitions(${target} PRIVATE _POSIX_C_SOURCE=200809L _DEFAULT_SOURCE=1)
    if(VEDUTA_SANITIZE)
        target_compile_options(${target} PRIVATE -fsanitize=${VEDUTA_SANITIZE}
                               -fno-omit-frame-pointer -fno-sanitize-recover=all)
        target_link_options(${target} PRIVATE -fsanitize=${VEDUTA_SANITIZE})
    endif()
    if(VEDUTA_FUZZ)
        target_compile_options(${target} PRIVATE -fsanitize=fuzzer-no-link)
    endif()
endfunction()

# veduta_objects(TARGET): an object library of ours: flags and include paths.
function(veduta_objects target)
    veduta_flags(${target})
    target_include_directories(${target} PUBLIC ${PROJECT_SOURCE_DIR}/include
                               PRIVATE ${PROJECT_SOURCE_DIR}/src)
    target_compile_definitions(${target} PRIVATE VEDUTA_VERSION="${PROJECT_VERSION}")
endfunction()

# veduta_library(TARGET): version, include path and export of a library made of such objects.
function(veduta_library target)
    target_include_directories(${target}
        PUBLIC $<BUILD_INTERFACE:${PROJECT_SOURCE_DIR}/include>
               $<INSTALL_INTERFACE:${CMAKE_INSTALL_INCLUDEDIR}>)
    set_target_properties(${target} PROPERTIES LINKER_LANGUAGE C
        VERSION ${PROJECT_VERSION} SOVERSION ${PROJECT_VERSION_MAJOR}
        LIBRARY_OUTPUT_DIRECTORY ${PROJECT_BINARY_DIR}
        ARCHIVE_OUTPUT_DIRECTORY ${PROJECT_BINARY_DIR}
        BUILD_RPATH_USE_ORIGIN ON INSTALL_RPATH "$ORIGIN")
    if(VEDUTA_SANITIZE)
        target_link_options(${target} PRIVATE -fsanitize=${VEDUTA_SANITIZE})
    endif()
endfunction()
