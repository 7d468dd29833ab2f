// Reads a picture from a file as a grey picture for tag detection.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include <lightwell/result.hpp>

#include "pose/grey_picture.hpp"

namespace lightwell::calibrate {

struct GreyImage {
  int width = 0, height = 0;
  std::vector<std::uint8_t> data;

  [[nodiscard]] GreyPicture view() const { return {data, width, height, static_cast<std::size_t>(width)}; }
};

/// PNG or JPEG. Errors name the file.
[[nodiscard]] Result<GreyImage> read_grey(const std::string& path);

}  // namespace lightwell::calibrate
