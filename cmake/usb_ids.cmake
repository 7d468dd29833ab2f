# Reads the USB vendor and product numbers and the manufacturer string of a probe from the C++ header that defines
# them, for files in other languages.
# lightwell_usb_file(<input> <output>) replaces @USB_VENDOR@, @USB_PRODUCT@ (four hexadecimal digits) and
# @USB_MANUFACTURER@.
function(lightwell_usb_file input output)
  set(header "${PROJECT_SOURCE_DIR}/proto/include/lightwell/usb_ids.hpp")
  set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS "${header}")
  file(READ "${header}" text)
  foreach(name IN ITEMS Vendor Product)
    if(NOT text MATCHES "kUsb${name} = 0x([0-9A-Fa-f][0-9A-Fa-f][0-9A-Fa-f][0-9A-Fa-f]);")
      message(FATAL_ERROR "${header}: kUsb${name} is not written as 0x and four hexadecimal digits")
    endif()
    string(TOUPPER ${name} upper)
    string(TOLOWER "${CMAKE_MATCH_1}" USB_${upper})
  endforeach()
  if(NOT text MATCHES "kUsbManufacturer\\[\\] = \"([^\"]+)\";")
    message(FATAL_ERROR "${header}: kUsbManufacturer was not found")
  endif()
  set(USB_MANUFACTURER "${CMAKE_MATCH_1}")
  configure_file("${input}" "${output}" @ONLY)
endfunction()
