#include "bench/straughn2018_tags.hpp"

#include <algorithm>
#include <utility>

#include "calibration/model/response.hpp"

namespace lightwell::bench {

StraughnTagDetector::StraughnTagDetector(StraughnTagOptions options, TagDetector detector)
    : options_(std::move(options)), detector_(std::move(detector)) {}

Result<StraughnTagDetector> StraughnTagDetector::make(const StraughnTagOptions& options) {
  TagDetectorOptions of_detector;
  of_detector.families = {options.family};
  of_detector.corners = options.thresholds.empty() ? CornerRefinement::edge_fit : CornerRefinement::none;
  if (options.encoding == StraughnEncoding::srgb) {
    PhotometricCalibration photometry;
    photometry.response.kind = ResponseCurve::Kind::srgb;
    of_detector.linear = linear_table(photometry, 256);
  }
  Result<TagDetector> made = TagDetector::make(of_detector);
  if (!made) return made.status();
  return StraughnTagDetector(options, std::move(*made));
}

Status StraughnTagDetector::detect_pass(const StraughnPicture& picture, const std::vector<std::uint8_t>& grey,
                                        std::vector<StraughnTag>& tags) {
  const auto found = detector_.detect({grey, picture.width, picture.height, static_cast<std::size_t>(picture.width)});
  if (!found) return found.status();
  const std::size_t before = tags.size();
  for (const TagDetection& d : *found) {
    const auto end = tags.begin() + static_cast<std::ptrdiff_t>(before);
    if (std::any_of(tags.begin(), end, [&](const StraughnTag& t) { return t.id == d.id; })) continue;
    StraughnTag tag{d.id, {}};
    for (std::size_t k = 0; k < 4; ++k) tag.corners_px[k] = {d.corners[k].x, d.corners[k].y};
    tags.push_back(tag);
  }
  return {};
}

Result<std::vector<StraughnTag>> StraughnTagDetector::detect(const StraughnPicture& picture) {
  const auto width = static_cast<std::size_t>(std::max(0, picture.width));
  const auto height = static_cast<std::size_t>(std::max(0, picture.height));
  const std::size_t row = width * static_cast<std::size_t>(picture.channels);
  if (width == 0 || height == 0 || picture.stride < row || picture.data.size() < (height - 1) * picture.stride + row)
    return Status(StatusCode::invalid_argument, "the data is smaller than the image");
  grey_.resize(width * height);
  for (std::size_t y = 0; y < height; ++y) {
    const std::uint8_t* from = picture.data.data() + y * picture.stride;
    // Rec. 601 luma in 256ths, as sent by webcams.
    for (std::size_t x = 0; x < width; ++x) {
      const std::uint8_t* p = from + 3 * x;
      grey_[y * width + x] =
          picture.channels == 1 ? from[x] : static_cast<std::uint8_t>((77 * p[0] + 150 * p[1] + 29 * p[2] + 128) / 256);
    }
  }
  std::vector<StraughnTag> tags;
  if (options_.thresholds.empty()) {
    if (const Status s = detect_pass(picture, grey_, tags); !s.ok()) return s;
  }
  for (const int threshold : options_.thresholds) {
    binary_.resize(grey_.size());
    std::transform(grey_.begin(), grey_.end(), binary_.begin(),
                   [&](std::uint8_t v) { return static_cast<std::uint8_t>(v > threshold ? 255 : 0); });
    if (const Status s = detect_pass(picture, binary_, tags); !s.ok()) return s;
  }
  return tags;
}

}  // namespace lightwell::bench
