include(GNUInstallDirs)
include(CMakePackageConfigHelpers)

# Components: each install rule of the tree names one of these. `cmake --install` installs all of them,
# `cmake --install BUILD --component NAME` one; cmake/packaging.cmake makes a Debian package of each.
#   daemon        the probe: lightwelld, its service, marker bodies, the USB gadget
#   library       liblightwell.so.1
#   development   headers, static libraries, CMake package, pkg-config, .proto files; sources and packages for C#, Unity, npm
#   tools         programs of the firmware and of the SDK, the OpenXR layer, liblightwell's module of the light field, the
#                 host's udev rule
#   python        the Python package

# Builds whatever the components daemon, library and tools install: what the emulated board needs.
add_custom_target(lightwell_installed)

# lightwell_install(<target> <component>): installs a program or a module by a component, and builds it with the target
# lightwell_installed.
function(lightwell_install name component)
  install(TARGETS ${name}
          RUNTIME DESTINATION "${CMAKE_INSTALL_BINDIR}" COMPONENT ${component}
          LIBRARY DESTINATION "${CMAKE_INSTALL_LIBDIR}" COMPONENT ${component})
  add_dependencies(lightwell_installed ${name})
endfunction()

# lightwell_install_sdk([<target>...])
# Installs the host SDK as the CMake package `lightwell` with the target lightwell::lightwell:
# static libraries, headers, .proto files; and liblightwell.so as the package's component `c`, with the target
# lightwell::lightwell_c, and for pkg-config as `lightwell`. Further targets given are exported, too, under their
# EXPORT_NAME. Needs lightwell_host_sdk and the libraries of proto, of which
# lightwell_proto_firmware is not installed.
function(lightwell_install_sdk)
  set_target_properties(lightwell_host_sdk PROPERTIES EXPORT_NAME lightwell)
  set_target_properties(lightwell_proto PROPERTIES EXPORT_NAME proto)
  # Applications link these, because the SDK's static library needs them, but never include their headers.
  set(needed lightwell_proto_messages)
  if(LIGHTWELL_WITH_GRPC)
    list(APPEND needed lightwell_proto_services)
  endif()
  if(LIGHTWELL_WITH_GRPC OR LIBWEBSOCKETS_FOUND)
    list(APPEND needed lightwell_pairing)
  endif()
  if(TARGET lightwell_mqtt_session)
    list(APPEND needed lightwell_mqtt_session)
  endif()
  foreach(library IN LISTS needed)
    string(REPLACE "lightwell_" "" name ${library})
    set_target_properties(${library} PROPERTIES EXPORT_NAME ${name})
  endforeach()
  # An example builds the same in this tree and against the installed package.
  add_library(lightwell::lightwell ALIAS lightwell_host_sdk)

  install(TARGETS lightwell_host_sdk lightwell_proto ${needed} ${ARGN}
          EXPORT lightwellTargets
          COMPONENT development
          INCLUDES DESTINATION "${CMAKE_INSTALL_INCLUDEDIR}")
  # CMake's --strip leaves archives as they are.
  install(CODE "
    if(CMAKE_INSTALL_DO_STRIP)
      file(GLOB archives \"\$ENV{DESTDIR}\${CMAKE_INSTALL_PREFIX}/${CMAKE_INSTALL_LIBDIR}/liblightwell_*.a\")
      execute_process(COMMAND \"${CMAKE_STRIP}\" --strip-debug --enable-deterministic-archives \${archives}
                      COMMAND_ERROR_IS_FATAL ANY)
    endif()" COMPONENT development)
  install(DIRECTORY "${PROJECT_SOURCE_DIR}/proto/include/" "${PROJECT_SOURCE_DIR}/host_sdk/include/"
          DESTINATION "${CMAKE_INSTALL_INCLUDEDIR}" COMPONENT development
          FILES_MATCHING PATTERN "*.hpp" PATTERN "*.h")
  install(DIRECTORY "${PROJECT_SOURCE_DIR}/proto/lightwell"
          DESTINATION "${CMAKE_INSTALL_DATADIR}/lightwell/proto" COMPONENT development
          FILES_MATCHING PATTERN "*.proto")

  set(package_dir "${CMAKE_INSTALL_LIBDIR}/cmake/lightwell")
  install(EXPORT lightwellTargets NAMESPACE lightwell:: DESTINATION "${package_dir}" COMPONENT development)

  # A separate export set, so that applications of the C ABI build without gRPC and protobuf.
  # lightwell.dll is a RUNTIME artifact, its import library an ARCHIVE.
  add_dependencies(lightwell_installed lightwell_c)
  install(TARGETS lightwell_c EXPORT lightwellCTargets
          RUNTIME COMPONENT library
          LIBRARY COMPONENT library NAMELINK_COMPONENT development
          ARCHIVE COMPONENT development
          INCLUDES DESTINATION "${CMAKE_INSTALL_INCLUDEDIR}")
  install(EXPORT lightwellCTargets NAMESPACE lightwell:: DESTINATION "${package_dir}" COMPONENT development)
  # ../.. or, with a folder for each architecture below lib, ../../..
  cmake_path(RELATIVE_PATH CMAKE_INSTALL_PREFIX
             BASE_DIRECTORY "${CMAKE_INSTALL_PREFIX}/${CMAKE_INSTALL_LIBDIR}/pkgconfig" OUTPUT_VARIABLE prefix_from_pkgconfig)
  configure_file("${PROJECT_SOURCE_DIR}/cmake/lightwell.pc.in" "${PROJECT_BINARY_DIR}/lightwell.pc" @ONLY)
  install(FILES "${PROJECT_BINARY_DIR}/lightwell.pc" DESTINATION "${CMAKE_INSTALL_LIBDIR}/pkgconfig"
          COMPONENT development)

  set(RELIGHT_HAS_OPENCV FALSE)
  if(TARGET lightwell_relight AND TARGET opencv_video)
    set(RELIGHT_HAS_OPENCV TRUE)
  endif()
  configure_package_config_file(
    "${PROJECT_SOURCE_DIR}/cmake/lightwellConfig.cmake.in"
    "${PROJECT_BINARY_DIR}/lightwellConfig.cmake"
    INSTALL_DESTINATION "${package_dir}")
  # Before 1.0 a minor version may change the API incompatibly.
  write_basic_package_version_file("${PROJECT_BINARY_DIR}/lightwellConfigVersion.cmake"
    COMPATIBILITY SameMinorVersion)
  install(FILES "${PROJECT_BINARY_DIR}/lightwellConfig.cmake"
                "${PROJECT_BINARY_DIR}/lightwellConfigVersion.cmake"
          DESTINATION "${package_dir}" COMPONENT development)
endfunction()
