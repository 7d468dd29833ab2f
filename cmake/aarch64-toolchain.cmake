# Cross-compiles for the board (64-bit ARM, Debian 12) and runs what was built under qemu-user.
# Uses the sysroot that cmake/sysroot_aarch64 made; it is not made here, because nothing is downloaded
# at configure time. The environment variable LIGHTWELL_SYSROOT_AARCH64 names another one.

set(CMAKE_SYSTEM_NAME Linux)
set(CMAKE_SYSTEM_PROCESSOR aarch64)
set(CMAKE_C_COMPILER aarch64-linux-gnu-gcc)
set(CMAKE_CXX_COMPILER aarch64-linux-gnu-g++)

if(NOT "$ENV{LIGHTWELL_SYSROOT_AARCH64}" STREQUAL "")
  set(CMAKE_SYSROOT "$ENV{LIGHTWELL_SYSROOT_AARCH64}")
else()
  execute_process(COMMAND "${CMAKE_CURRENT_LIST_DIR}/sysroot_aarch64" --find
                  OUTPUT_VARIABLE CMAKE_SYSROOT OUTPUT_STRIP_TRAILING_WHITESPACE)
endif()
if(CMAKE_SYSROOT STREQUAL "")
  message(FATAL_ERROR "There is no sysroot for aarch64: run cmake/sysroot_aarch64 to make it.")
elseif(NOT IS_DIRECTORY "${CMAKE_SYSROOT}/usr/include")
  message(FATAL_ERROR "LIGHTWELL_SYSROOT_AARCH64 is '${CMAKE_SYSROOT}', which contains no usr/include: "
                      "unset it to use the sysroot that cmake/sysroot_aarch64 made.")
endif()

# The cache holds full paths of files in the sysroot: with another sysroot the two would be mixed.
if(LIGHTWELL_SYSROOT_IN_USE AND NOT LIGHTWELL_SYSROOT_IN_USE STREQUAL CMAKE_SYSROOT)
  message(FATAL_ERROR "This build was configured for the sysroot ${LIGHTWELL_SYSROOT_IN_USE}, and now it is "
                      "${CMAKE_SYSROOT}: run cmake --fresh --preset board-aarch64.")
endif()
set(LIGHTWELL_SYSROOT_IN_USE "${CMAKE_SYSROOT}" CACHE INTERNAL "")

# Headers, libraries and packages come from the sysroot; protoc, grpc_cpp_plugin and Python from this machine.
set(CMAKE_FIND_ROOT_PATH_MODE_PROGRAM NEVER)
set(CMAKE_FIND_ROOT_PATH_MODE_LIBRARY ONLY)
set(CMAKE_FIND_ROOT_PATH_MODE_INCLUDE ONLY)
set(CMAKE_FIND_ROOT_PATH_MODE_PACKAGE ONLY)
set(ENV{PKG_CONFIG_SYSROOT_DIR} "${CMAKE_SYSROOT}")
set(ENV{PKG_CONFIG_LIBDIR}
    "${CMAKE_SYSROOT}/usr/lib/aarch64-linux-gnu/pkgconfig:${CMAKE_SYSROOT}/usr/share/pkgconfig")

# Emulate the processor of the smallest supported board (Raspberry Pi 4), so that instructions that it lacks
# fail here, too.
find_program(LIGHTWELL_QEMU_AARCH64 NAMES qemu-aarch64 qemu-aarch64-static)
if(LIGHTWELL_QEMU_AARCH64)
  set(CMAKE_CROSSCOMPILING_EMULATOR
      "${LIGHTWELL_QEMU_AARCH64};-cpu;cortex-a72;-L;${CMAKE_SYSROOT}")
else()
  message(FATAL_ERROR "qemu-aarch64 was not found: it is in Debian's package qemu-user. Run cmake/setup.")
endif()
