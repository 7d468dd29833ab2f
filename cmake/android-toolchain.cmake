# Cross-compiles the SDK for Android, 64-bit ARM, with the NDK's own toolchain file. Not checked: no NDK was available (see
# host_sdk/README.md). ANDROID_NDK_HOME is the folder of the NDK, LIGHTWELL_SYSROOT_SDK a folder with static libraries of
# protobuf, OpenSSL, libwebsockets and Highway for Android, built as in cmake/sysroot_sdk.
if("$ENV{ANDROID_NDK_HOME}" STREQUAL "" OR "$ENV{LIGHTWELL_SYSROOT_SDK}" STREQUAL "")
  message(FATAL_ERROR "Set ANDROID_NDK_HOME to the folder of the NDK, and LIGHTWELL_SYSROOT_SDK to the folder of the libraries "
                      "for Android.")
endif()
set(ANDROID_ABI arm64-v8a CACHE STRING "")
# minSdk: if_indextoname() is there from 24 on. Not checked: no NDK was at hand.
set(ANDROID_PLATFORM android-26 CACHE STRING "")
# One file to ship.
set(ANDROID_STL c++_static CACHE STRING "")
set(LIGHTWELL_SDK_TARGET android CACHE STRING "")
include("$ENV{ANDROID_NDK_HOME}/build/cmake/android.toolchain.cmake")
include("${CMAKE_CURRENT_LIST_DIR}/sdk_sysroot.cmake")
