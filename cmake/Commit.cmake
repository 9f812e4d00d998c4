# Commit.cmake: writes OUT with the commit that is being built. Run at build time, so that it cannot
# go stale; leaves OUT alone when nothing changed, so that nothing is recompiled for it.
#
#   cmake -DSOURCE=… -DOUT=… -P Commit.cmake
cmake_minimum_required(VERSION 3.22)
set(commit unknown)
find_program(GIT git)
if(GIT)
    # The full hash, with -dirty when files differ from it; never a tag.
    execute_process(COMMAND ${GIT} -C ${SOURCE} describe --always --dirty --abbrev=40 --exclude=*
                    OUTPUT_VARIABLE described OUTPUT_STRIP_TRAILING_WHITESPACE ERROR_QUIET
                    RESULT_VARIABLE failed)
    # A tarball unpacked inside somebody else's repository is not that repository's commit.
    execute_process(COMMAND ${GIT} -C ${SOURCE} rev-parse --show-cdup
                    OUTPUT_VARIABLE above OUTPUT_STRIP_TRAILING_WHITESPACE ERROR_QUIET)
    if(NOT failed AND described AND "${above}" STREQUAL "")
        set(commit ${described})
    endif()
endif()
file(CONFIGURE OUTPUT ${OUT} CONTENT "#define VEDUTA_COMMIT \"@commit@\"\n" @ONLY)
