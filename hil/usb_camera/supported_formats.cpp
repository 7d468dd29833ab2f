#include "usb_camera/supported_formats.hpp"

namespace lightwell::usb_camera {

SupportedFormats formats_for(std::string_view rig) {
  SupportedFormats formats;
  if (rig == "equirect") {
    formats.sizes = {{640, 320}, {320, 160}, {1280, 640}, {1920, 960}};
  } else {
    formats.sizes = {{640, 480}, {160, 120}, {320, 240}, {1280, 720}, {1280, 960}, {1920, 1080}};
  }
  return formats;
}

std::size_t largest_frame(Encoding encoding, FrameSize size) {
  const auto pixels = static_cast<std::size_t>(size.width) * static_cast<std::size_t>(size.height);
  return encoding == Encoding::nv12 ? pixels + pixels / 2 : 2 * pixels;
}

}  // namespace lightwell::usb_camera
