# Cross-compiles the SDK for x86-64 Windows (Windows 10 or later) with Debian's mingw-w64, and runs what was built under
# Wine. Uses the sysroot that `cmake/sysroot_sdk windows` made; it is not made here, because nothing is downloaded at
# configure time. The environment variable LIGHTWELL_SYSROOT_SDK names another one.

set(CMAKE_SYSTEM_NAME Windows)
set(CMAKE_SYSTEM_PROCESSOR x86_64)
# The variant with POSIX threads: <thread> and <mutex> of the other one are missing.
set(CMAKE_C_COMPILER x86_64-w64-mingw32-gcc-posix)
set(CMAKE_CXX_COMPILER x86_64-w64-mingw32-g++-posix)
set(CMAKE_RC_COMPILER x86_64-w64-mingw32-windres)
set(LIGHTWELL_SDK_TARGET windows CACHE STRING "")
include("${CMAKE_CURRENT_LIST_DIR}/sdk_sysroot.cmake")

# One file to ship: the compiler's runtime is in each program and library. Windows 10.
add_compile_definitions(_WIN32_WINNT=0x0A00 WINVER=0x0A00)
set(CMAKE_EXE_LINKER_FLAGS_INIT "-static")
set(CMAKE_SHARED_LINKER_FLAGS_INIT "-static")
set(CMAKE_MODULE_LINKER_FLAGS_INIT "-static")

# Debian's wine64 has no program in the path without the package wine. Programs find lightwell.dll by WINEPATH. Each build
# folder has a Windows of its own, which the first program makes; Wine's own messages and its offers to install Mono and
# Gecko are switched off.
find_program(LIGHTWELL_WINE NAMES wine64 wine PATHS /usr/lib/wine)
if(LIGHTWELL_WINE)
  set(CMAKE_CROSSCOMPILING_EMULATOR
      "/usr/bin/env;WINEPREFIX=${CMAKE_BINARY_DIR}/wine;WINEPATH=Z:${CMAKE_BINARY_DIR}/lib;WINEDEBUG=-all"
      "WINEDLLOVERRIDES=mscoree,mshtml=;${LIGHTWELL_WINE}")
endif()
