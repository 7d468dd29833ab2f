// Encodes small pictures as JPEG with libjpeg.
#pragma once

#include <cstddef>
#include <vector>

#include <lightwell/result.hpp>

#include "imaging/image_file.hpp"

namespace lightwell {

/// Baseline JPEG (JFIF, YCbCr 4:2:0). `image` is rgb8; `quality`: libjpeg's scale, 1 to 100. invalid_argument: another
/// format, an empty picture or one with a side above 65,500; internal: libjpeg's error.
[[nodiscard]] Result<std::vector<std::byte>> encode_jpeg(const Image& image, int quality);

}  // namespace lightwell
