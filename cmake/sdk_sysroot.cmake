# Part of the toolchain files windows-toolchain.cmake and zig_toolchain.cmake: the sysroot that cmake/sysroot_sdk made.
if(NOT "$ENV{LIGHTWELL_SYSROOT_SDK}" STREQUAL "")
  set(LIGHTWELL_SDK_SYSROOT "$ENV{LIGHTWELL_SYSROOT_SDK}")
else()
  execute_process(COMMAND "${CMAKE_CURRENT_LIST_DIR}/sysroot_sdk" ${LIGHTWELL_SDK_TARGET} --find
                  OUTPUT_VARIABLE LIGHTWELL_SDK_SYSROOT OUTPUT_STRIP_TRAILING_WHITESPACE)
endif()
if(LIGHTWELL_SDK_SYSROOT STREQUAL "")
  message(FATAL_ERROR "There is no sysroot for ${LIGHTWELL_SDK_TARGET}: run `cmake/sysroot_sdk ${LIGHTWELL_SDK_TARGET}` to make it.")
endif()

# The cache holds full paths of files in the sysroot: with another sysroot the two would be mixed.
if(LIGHTWELL_SDK_SYSROOT_IN_USE AND NOT LIGHTWELL_SDK_SYSROOT_IN_USE STREQUAL LIGHTWELL_SDK_SYSROOT)
  message(FATAL_ERROR "This build was configured for the sysroot ${LIGHTWELL_SDK_SYSROOT_IN_USE}, and now it is "
                      "${LIGHTWELL_SDK_SYSROOT}: run cmake --fresh with the same preset.")
endif()
set(LIGHTWELL_SDK_SYSROOT_IN_USE "${LIGHTWELL_SDK_SYSROOT}" CACHE INTERNAL "")

# Headers, libraries and packages come from the sysroot; protoc and Python from this machine.
set(CMAKE_FIND_ROOT_PATH "${LIGHTWELL_SDK_SYSROOT}")
set(CMAKE_FIND_ROOT_PATH_MODE_PROGRAM NEVER)
set(CMAKE_FIND_ROOT_PATH_MODE_LIBRARY ONLY)
set(CMAKE_FIND_ROOT_PATH_MODE_INCLUDE ONLY)
set(CMAKE_FIND_ROOT_PATH_MODE_PACKAGE ONLY)
set(ENV{PKG_CONFIG_LIBDIR} "${LIGHTWELL_SDK_SYSROOT}/lib/pkgconfig")
