# Cross-compiles for the board (64-bit ARM, Debian 12) and runs what was built under qemu-user.
# The sysroot is the one that cmake/sysroot_aarch64 made; it is not made here, because nothing is
# downloaded at configure time. Another one: the environment variable LIGHTWELL_SYSROOT_AARCH64.

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
  message(FATAL_ERROR "There is no sysroot for aarch64: run cmake/sysroot_aarch64, which makes it.")
elseif(NOT IS_DIRECTORY "${CMAKE_SYSROOT}/usr/include")
  message(FATAL_ERROR "LIGHTWELL_SYSROOT_AARCH64 is '${CMAKE_SYSROOT}', which holds no usr/include: "
                      "unset it, and the one that cmake/sysroot_aarch64 made is taken.")
endif()

# What was found in one sysroot is in the cache by its full path: the next one would be mixed with it.
if(LIGHTWELL_SYSROOT_IN_USE AND NOT LIGHTWELL_SYSROOT_IN_USE STREQUAL CMAKE_SYSROOT)
  message(FATAL_ERROR "This build used the sysroot ${LIGHTWELL_SYSROOT_IN_USE}, and it is ${CMAKE_SYSROOT} "
                      "now: run cmake --fresh --preset board-aarch64.")
endif()
set(LIGHTWELL_SYSROOT_IN_USE "${CMAKE_SYSROOT}" CACHE INTERNAL "")

# Headers, libraries and packages are the board's; protoc, grpc_cpp_plugin and Python this machine's.
set(CMAKE_FIND_ROOT_PATH_MODE_PROGRAM NEVER)
set(CMAKE_FIND_ROOT_PATH_MODE_LIBRARY ONLY)
set(CMAKE_FIND_ROOT_PATH_MODE_INCLUDE ONLY)
set(CMAKE_FIND_ROOT_PATH_MODE_PACKAGE ONLY)
set(ENV{PKG_CONFIG_SYSROOT_DIR} "${CMAKE_SYSROOT}")
set(ENV{PKG_CONFIG_LIBDIR}
    "${CMAKE_SYSROOT}/usr/lib/aarch64-linux-gnu/pkgconfig:${CMAKE_SYSROOT}/usr/share/pkgconfig")

# The processor of the smallest board that is supported (Raspberry Pi 4): what it cannot do fails here,
# and not on the board only.
find_program(LIGHTWELL_QEMU_AARCH64 NAMES qemu-aarch64 qemu-aarch64-static)
if(LIGHTWELL_QEMU_AARCH64)
  set(CMAKE_CROSSCOMPILING_EMULATOR
      "${LIGHTWELL_QEMU_AARCH64};-cpu;cortex-a72;-L;${CMAKE_SYSROOT}")
else()
  message(FATAL_ERROR "qemu-aarch64 was not found: it is in Debian's package qemu-user. Run cmake/setup.")
endif()
