# An overlay port, from the source tree that holds it: vcpkg install lightwell --overlay-ports=host_sdk/recipes/vcpkg
get_filename_component(SOURCE_PATH "${CMAKE_CURRENT_LIST_DIR}/../../../.." ABSOLUTE)

set(without ar_viewer openxr_layer mdns)
foreach(part IN ITEMS web mqtt usb)
  if(NOT part IN_LIST FEATURES)
    list(APPEND without ${part})
  endif()
endforeach()
set(grpc OFF)
if("grpc" IN_LIST FEATURES)
  set(grpc ON)
endif()

vcpkg_cmake_configure(
  SOURCE_PATH "${SOURCE_PATH}"
  OPTIONS
    -DLIGHTWELL_BUILD_FIRMWARE=OFF -DLIGHTWELL_BUILD_TESTS=OFF -DLIGHTWELL_BUILD_HIL=OFF
    -DLIGHTWELL_WITH_GRPC=${grpc} "-DLIGHTWELL_WITHOUT=${without}")
vcpkg_cmake_install()
vcpkg_cmake_config_fixup(CONFIG_PATH lib/cmake/lightwell)
vcpkg_fixup_pkgconfig()
file(REMOVE_RECURSE "${CURRENT_PACKAGES_DIR}/debug/include" "${CURRENT_PACKAGES_DIR}/debug/share"
                    "${CURRENT_PACKAGES_DIR}/lib/python3" "${CURRENT_PACKAGES_DIR}/debug/lib/python3")
vcpkg_install_copyright(FILE_LIST "${SOURCE_PATH}/LICENSE")
