// Detects tags in the picture of a whole sheet of paper.
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "imaging/image_file.hpp"
#include "pose/tag_detector.hpp"
#include "tools/lightwell_calibrate/sheets.hpp"

namespace lightwell::test {

/// Corners of each tag by its id, in the order of TagDetection, mm from the top left of the sheet, y downwards.
inline std::map<int, std::array<calibrate::PagePoint, 4>> printed_tags(const std::string& picture, TagFamily family,
                                                                       double dpi) {
  std::map<int, std::array<calibrate::PagePoint, 4>> out;
  const Result<Image> image = read_image(picture);
  EXPECT_TRUE(image) << image.status().message();
  if (!image) return out;
  std::vector<std::uint8_t> grey;
  for (std::size_t i = 0; i < image->data.size(); i += 3) grey.push_back(std::to_integer<std::uint8_t>(image->data[i]));
  TagDetectorOptions options;
  options.families = {family};
  auto detector = TagDetector::make(options);
  const auto tags = detector->detect({grey, image->width, image->height, static_cast<std::size_t>(image->width)});
  EXPECT_TRUE(tags) << tags.status().message();
  for (const TagDetection& tag : *tags) {
    EXPECT_EQ(tag.hamming, 0) << tag.id;
    EXPECT_TRUE(tag.refined) << tag.id;
    EXPECT_FALSE(out.contains(tag.id)) << "twice";
    // (0, 0) is the centre of the first pixel, half a pixel from the sheet's edges.
    for (std::size_t k = 0; k < 4; ++k)
      out[tag.id][k] = {(tag.corners[k].x + 0.5) * 25.4 / dpi, (tag.corners[k].y + 0.5) * 25.4 / dpi};
  }
  return out;
}

}  // namespace lightwell::test
