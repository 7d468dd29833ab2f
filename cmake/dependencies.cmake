# Finds every third-party library on the system; nothing is downloaded while configuring. Grouped by
# the option that needs it, so that the host SDK alone requires protobuf and Highway only.

# lightwell_find(<package> <Debian package> [arguments of find_package...])
# A macro, because the caller needs the variables that find_package sets.
macro(lightwell_find package debian)
  # Debian's package files print messages about optional parts even with QUIET.
  set(CMAKE_MESSAGE_LOG_LEVEL NOTICE)
  find_package(${package} ${ARGN} QUIET)
  unset(CMAKE_MESSAGE_LOG_LEVEL)
  if(NOT ${package}_FOUND)
    lightwell_missing(${package} ${debian})
  endif()
endmacro()

# lightwell_optional(<part> <prefix> <module>): pkg_check_modules, unless LIGHTWELL_WITHOUT names the part.
macro(lightwell_optional part prefix module)
  if(NOT "${part}" IN_LIST LIGHTWELL_WITHOUT)
    pkg_check_modules(${prefix} QUIET IMPORTED_TARGET ${module})
  endif()
endmacro()

function(lightwell_missing what debian)
  message(FATAL_ERROR "${what} was not found: it is in Debian's package ${debian}. "
                      "Run cmake/setup, which installs all that cmake/packages.txt lists.")
endfunction()

# The two OpenCV libraries that hil/report draws with. OpenCV's CMake package file is in libopencv-dev only,
# which installs some two hundred packages; these two libraries have a package of their own.
function(lightwell_find_opencv_drawing)
  find_path(LIGHTWELL_OPENCV_INCLUDE opencv2/imgproc.hpp PATH_SUFFIXES opencv4)
  foreach(part IN ITEMS opencv_core opencv_imgproc)
    find_library(LIGHTWELL_${part} ${part})
    if(NOT LIGHTWELL_OPENCV_INCLUDE OR NOT LIGHTWELL_${part})
      lightwell_missing(${part} libopencv-imgproc-dev)
    endif()
    add_library(${part} UNKNOWN IMPORTED GLOBAL)
    set_target_properties(${part} PROPERTIES
      IMPORTED_LOCATION "${LIGHTWELL_${part}}" INTERFACE_INCLUDE_DIRECTORIES "${LIGHTWELL_OPENCV_INCLUDE}")
  endforeach()
endfunction()

# For proto
find_package(Threads REQUIRED)
lightwell_find(Protobuf libprotobuf-dev 3.21 MODULE)
if(NOT TARGET protobuf::protoc)
  lightwell_missing(protoc protobuf-compiler)
endif()
lightwell_find(PkgConfig pkg-config)  # gRPC's package file asks it for re2

# For both ends of the network link and of pairing. The firmware requires gRPC. Without it the SDK leaves both out; the
# summary reports it.
if(LIGHTWELL_BUILD_FIRMWARE)
  lightwell_find(gRPC libgrpc++-dev CONFIG)
elseif(LIGHTWELL_WITH_GRPC)
  find_package(gRPC CONFIG QUIET)
  if(NOT gRPC_FOUND)
    set(LIGHTWELL_WITH_GRPC OFF)
  endif()
endif()
if(gRPC_FOUND)
  find_program(LIGHTWELL_GRPC_CPP_PLUGIN grpc_cpp_plugin)
  if(NOT LIGHTWELL_GRPC_CPP_PLUGIN)
    lightwell_missing(grpc_cpp_plugin protobuf-compiler-grpc)
  endif()
endif()

pkg_check_modules(LIBHWY QUIET IMPORTED_TARGET libhwy)
if(NOT LIBHWY_FOUND)
  lightwell_missing(libhwy libhwy-dev)
endif()
# SVE's vectors have no size while compiling, so kernels could not keep them in arrays. With NEON
# alone, Highway calls it without asking the processor for AES, which a Raspberry Pi 4 lacks.
target_compile_definitions(PkgConfig::LIBHWY INTERFACE
  "HWY_DISABLED_TARGETS=(HWY_SVE|HWY_SVE2|HWY_SVE_256|HWY_SVE2_128)")

if(LIGHTWELL_BUILD_HOST_SDK)
  # For the host's USB link. Without the library the link is left out; the summary reports it.
  lightwell_optional(usb LIBUSB libusb-1.0)
endif()

# For WebSockets, MQTT and mDNS in the firmware and in the SDK. Without its library each is left out; the summary reports it.
lightwell_optional(mqtt LIBMOSQUITTO libmosquitto)
lightwell_optional(mdns AVAHI_CLIENT avahi-client)
lightwell_optional(web LIBWEBSOCKETS libwebsockets)

# For both ends of the two network links.
if(gRPC_FOUND OR LIBWEBSOCKETS_FOUND)
  lightwell_find(OpenSSL libssl-dev 3)
  if(WIN32)
    set_property(TARGET OpenSSL::Crypto APPEND PROPERTY INTERFACE_LINK_LIBRARIES ws2_32 crypt32)
  endif()
endif()

# For the dashboard: architecture-independent files of this machine, in a cross build too.
if(LIGHTWELL_BUILD_FIRMWARE AND LIBWEBSOCKETS_FOUND)
  find_program(LIGHTWELL_TSC tsc)
  find_file(LIGHTWELL_THREE three.min.js PATHS /usr/share/javascript/three NO_CMAKE_FIND_ROOT_PATH)
endif()

if(LIGHTWELL_BUILD_FIRMWARE)
  lightwell_find(OpenEXR libopenexr-dev CONFIG)
  lightwell_find(JPEG libjpeg-dev)
  lightwell_find(PNG libpng-dev)
  lightwell_find(Eigen3 libeigen3-dev CONFIG)
  lightwell_find(CLI11 libcli11-dev CONFIG)
  lightwell_find(nlohmann_json nlohmann-json3-dev CONFIG)
  if(NOT "tools" IN_LIST LIGHTWELL_WITHOUT)
    lightwell_find(OpenCV libopencv-dev COMPONENTS core imgproc imgcodecs calib3d)
    lightwell_find(yaml-cpp libyaml-cpp-dev CONFIG)
  elseif(LIGHTWELL_BUILD_HIL)
    lightwell_find_opencv_drawing()
  endif()
  if(NOT "pose" IN_LIST LIGHTWELL_WITHOUT)
    lightwell_find(apriltag libapriltag-dev CONFIG)
    lightwell_find(Ceres libceres-dev CONFIG)
  endif()
  if(TARGET Ceres::ceres AND CMAKE_CROSSCOMPILING)
    # The package file of Ceres names LAPACK by paths of the machine that it was built on. A sysroot has no alternatives
    # for BLAS and LAPACK, so the unversioned links are missing.
    get_target_property(LIGHTWELL_CERES_NEEDS Ceres::ceres INTERFACE_LINK_LIBRARIES)
    list(TRANSFORM LIGHTWELL_CERES_NEEDS REPLACE "^(/usr/lib/[^/]*/lib(blas|lapack)[.]so)$" "\\1.3")
    list(TRANSFORM LIGHTWELL_CERES_NEEDS REPLACE "^/usr/" "${CMAKE_SYSROOT}/usr/")
    set_target_properties(Ceres::ceres PROPERTIES INTERFACE_LINK_LIBRARIES "${LIGHTWELL_CERES_NEEDS}")
  endif()
  # Each is for one camera backend. Without the library the backend is left out; the summary reports it.
  lightwell_optional(libcamera LIBCAMERA libcamera)
  if(NOT "depthai" IN_LIST LIGHTWELL_WITHOUT)
    find_package(depthai 3 CONFIG QUIET)
  endif()
  pkg_check_modules(LIBSYSTEMD QUIET IMPORTED_TARGET libsystemd)
  if(NOT LIBSYSTEMD_FOUND)
    lightwell_missing(libsystemd libsystemd-dev)
  endif()
elseif(LIGHTWELL_BUILD_HOST_SDK)
  # Only for host_sdk/src/image_object. Without the library it is left out; the summary reports it.
  find_package(Eigen3 CONFIG QUIET)
  # Only for host_sdk/tools. Without the libraries the tools are left out; the summary reports it.
  find_package(OpenCV QUIET COMPONENTS core imgproc imgcodecs)
  find_package(CLI11 CONFIG QUIET)
  find_package(nlohmann_json CONFIG QUIET)
endif()

if(LIGHTWELL_BUILD_HOST_SDK)
  # For host_sdk/tools/ar_viewer. Without one of them the viewer is left out; the summary reports it.
  lightwell_optional(ar_viewer EPOXY epoxy)
  lightwell_optional(ar_viewer TINYGLTF tinygltf)
  lightwell_optional(ar_viewer GLFW glfw3)
  lightwell_optional(ar_viewer IMGUI imgui)
  # Where lightwell_find_opencv_drawing() has defined two of OpenCV's targets, its package file cannot define all of them.
  if(EPOXY_FOUND AND TINYGLTF_FOUND AND GLFW_FOUND AND IMGUI_FOUND AND (TARGET opencv_calib3d OR NOT TARGET opencv_core))
    find_package(glm CONFIG QUIET)
    find_package(apriltag CONFIG QUIET)
    find_package(OpenEXR CONFIG QUIET)
    find_package(OpenCV QUIET COMPONENTS core imgproc imgcodecs videoio calib3d)
  endif()

  # For host_sdk/src/field. Without Ceres the library is left out, without Embree its proxy geometry; the summary reports it.
  if(NOT "field" IN_LIST LIGHTWELL_WITHOUT)
    if(NOT LIGHTWELL_BUILD_FIRMWARE)
      find_package(Eigen3 CONFIG QUIET)
      find_package(Ceres CONFIG QUIET)
    endif()
    find_package(embree 3 CONFIG QUIET)
  endif()

  # For host_sdk/src/relight. Without Embree or Eigen the library is left out; the summary reports it.
  if(NOT "relight" IN_LIST LIGHTWELL_WITHOUT)
    if(NOT LIGHTWELL_BUILD_FIRMWARE)
      find_package(Eigen3 CONFIG QUIET)
    endif()
    find_package(embree 3 CONFIG QUIET)
  endif()

  # For host_sdk/examples/openxr_light and host_sdk/openxr_layer. Without it both are left out; the summary reports it.
  find_package(OpenXR CONFIG QUIET)
endif()

# For cmake/packaging.cmake. Without it there are no Debian packages; the summary reports it.
find_program(LIGHTWELL_DPKG_DEB dpkg-deb)

if(LIGHTWELL_BUILD_TESTS)
  # For the consumer of lightwell/glm.hpp in tests/install. Without it the consumer is left out; the summary reports it.
  find_package(glm CONFIG QUIET)
  # For tests/reference/image_object. Without it the renderer and its figures are left out; the summary reports it.
  find_package(embree 3 CONFIG QUIET)
  lightwell_find(GTest libgtest-dev CONFIG)
  if(NOT TARGET GTest::gmock)
    lightwell_missing(GMock libgmock-dev)
  endif()
  lightwell_find(Python3 python3 COMPONENTS Interpreter)
  # Debian's interpreter has Debian's packages; another one that comes first in the path may not have them.
  foreach(python IN ITEMS "${Python3_EXECUTABLE}" /usr/bin/python3)
    execute_process(COMMAND "${python}" -c "import google.protobuf" RESULT_VARIABLE lacks OUTPUT_QUIET ERROR_QUIET)
    if(lacks STREQUAL 0)
      set(LIGHTWELL_PYTHON_PROTOBUF "${python}")
      break()
    endif()
  endforeach()
  if(NOT LIGHTWELL_PYTHON_PROTOBUF)
    lightwell_missing(google.protobuf python3-protobuf)
  endif()
  if(LIGHTWELL_BUILD_FIRMWARE)
    # For firmware/tools/lightwell_plot.py, which draws what the tools print.
    foreach(python IN ITEMS "${Python3_EXECUTABLE}" /usr/bin/python3)
      execute_process(COMMAND "${python}" -c "import matplotlib" RESULT_VARIABLE lacks OUTPUT_QUIET ERROR_QUIET)
      if(lacks STREQUAL 0)
        set(LIGHTWELL_PYTHON_MATPLOTLIB "${python}")
        break()
      endif()
    endforeach()
    if(NOT LIGHTWELL_PYTHON_MATPLOTLIB)
      lightwell_missing(matplotlib python3-matplotlib)
    endif()
  endif()
  # For the languages on top of the C ABI. Without a language's tools its tests are left out; the summary reports it.
  # A cross build has none of them.
  if(LIGHTWELL_BUILD_HOST_SDK AND NOT CMAKE_CROSSCOMPILING)
    foreach(python IN ITEMS "${Python3_EXECUTABLE}" /usr/bin/python3)
      execute_process(COMMAND "${python}" -c "import numpy" RESULT_VARIABLE lacks OUTPUT_QUIET ERROR_QUIET)
      if(lacks STREQUAL 0)
        set(LIGHTWELL_PYTHON_NUMPY "${python}")
        break()
      endif()
    endforeach()
    find_program(LIGHTWELL_MCS mcs)
    find_program(LIGHTWELL_MONO mono)
    find_program(LIGHTWELL_NODE NAMES node nodejs)
    # With nodejs of nodejs.org; otherwise the package npm.
    find_program(LIGHTWELL_NPM npm)
    find_program(LIGHTWELL_TSC tsc)
    # Debian's node-ws: where Node has no WebSocket of its own, and as the server of tests.
    find_path(LIGHTWELL_NODE_WS ws/package.json PATHS /usr/share/nodejs)
    find_program(LIGHTWELL_CHROMIUM chromium)
  endif()
  # umockdev is preloaded (LD_PRELOAD), under qemu-user into the emulator itself, so only native builds use it.
  if(LIGHTWELL_BUILD_FIRMWARE AND NOT CMAKE_CROSSCOMPILING)
    pkg_check_modules(UMOCKDEV QUIET IMPORTED_TARGET umockdev-1.0)
    if(NOT UMOCKDEV_FOUND)
      lightwell_missing(umockdev-1.0 libumockdev-dev)
    endif()
  endif()
endif()

if(LIGHTWELL_BUILD_HIL)
  # For hil/usb_camera. Without the library its program is left out; the summary reports it.
  pkg_check_modules(USBREDIRPARSER QUIET IMPORTED_TARGET libusbredirparser-0.5)
endif()
