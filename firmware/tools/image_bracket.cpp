#include "tools/image_bracket.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <map>
#include <numbers>
#include <string>

namespace lightwell {
namespace {

Status invalid(const std::string& what) { return {StatusCode::invalid_argument, what}; }

std::string size_text(int width, int height) { return std::to_string(width) + "x" + std::to_string(height); }

std::size_t count_invalid(const Image& image) {
  if (image.format != PixelFormat::rgb_f32) return 0;
  std::size_t count = 0;
  for (std::size_t at = 0; at + sizeof(float) <= image.data.size(); at += sizeof(float)) {
    float v;
    std::memcpy(&v, image.data.data() + at, sizeof v);
    count += v >= 0 && std::isfinite(v) ? 0 : 1;
  }
  return count;
}

struct ExposedImage {
  double exposure_s;
  std::size_t image;
};

}  // namespace

RigParameters equirectangular_rig(int width, int height) {
  LensParameters lens;
  lens.width = width;
  lens.height = height;
  lens.model = EquirectangularParameters{};
  lens.max_angle_rad = std::numbers::pi;
  lens.pose_cv.rotation = upright_lens_cv();
  lens.photometry.response.kind = ResponseCurve::Kind::srgb;
  RigParameters rig;
  rig.lenses.push_back(lens);
  return rig;
}

Result<ImageBracket> read_bracket(const RigParameters& rig, const std::vector<ImageArgument>& arguments) {
  if (arguments.empty()) return invalid("no image is given");
  ImageBracket out;
  std::map<int, std::vector<ExposedImage>> by_lens;
  for (const ImageArgument& a : arguments) {
    if (a.lens < 0 || static_cast<std::size_t>(a.lens) >= rig.lenses.size())
      return invalid(a.path + ": lens " + std::to_string(a.lens) + " is not in the calibration, which has " +
                     std::to_string(rig.lenses.size()) + " (numbered from 0); see --lens");
    Result<Image> image = read_image(a.path);
    if (!image) return image.status();
    const LensParameters& lens = rig.lenses[static_cast<std::size_t>(a.lens)];
    if (image->width != lens.width || image->height != lens.height)
      return invalid(a.path + ": it has " + size_text(image->width, image->height) +
                     " pixels, the calibration of lens " + std::to_string(a.lens) + " is for " +
                     size_text(lens.width, lens.height));
    out.invalid_values += count_invalid(*image);
    out.images.push_back(std::make_unique<Image>(std::move(*image)));
    by_lens[a.lens].push_back({a.exposure_s > 0 ? a.exposure_s : 1, out.images.size() - 1});
  }

  std::vector<ExposedImage>& first = by_lens.begin()->second;
  for (auto& [lens, taken] : by_lens) {
    std::sort(taken.begin(), taken.end(),
              [](const ExposedImage& a, const ExposedImage& b) { return a.exposure_s < b.exposure_s; });
    for (std::size_t i = 0; i + 1 < taken.size(); ++i)
      if (taken[i].exposure_s == taken[i + 1].exposure_s)
        return invalid(
            "lens " + std::to_string(lens) + " has two images of " + std::to_string(taken[i].exposure_s) +
            " s; a bracket gives a different --exposure-s before each image, and --lens N before the images of "
            "another lens");
    const bool same = std::equal(taken.begin(), taken.end(), first.begin(), first.end(),
                                 [](const ExposedImage& a, const ExposedImage& b) {
                                   return std::abs(a.exposure_s - b.exposure_s) <= 1e-6 * b.exposure_s;
                                 });
    if (!same)
      return invalid("lens " + std::to_string(lens) + " and lens " + std::to_string(by_lens.begin()->first) +
                     " have different exposures; give every lens the same list of --exposure-s");
  }
  if (first.size() > kMaxBracket)
    return invalid("a bracket has at most " + std::to_string(kMaxBracket) + " exposures, this one has " +
                   std::to_string(first.size()));

  std::vector<int> numbers;
  for (const auto& [lens, taken] : by_lens) {
    numbers.push_back(lens);
    out.rig.lenses.push_back(rig.lenses[static_cast<std::size_t>(lens)]);
  }
  out.rig.nits_per_unit = rig.nits_per_unit;
  for (std::size_t k = 0; k < first.size(); ++k) {
    Frame frame;
    frame.info.sequence = k + 1;
    frame.info.exposure_s = first[k].exposure_s;
    frame.info.bracket_index = static_cast<int>(k);
    frame.info.bracket_size = static_cast<int>(first.size());
    for (std::size_t i = 0; i < numbers.size(); ++i) {
      const Image& image = *out.images[by_lens[numbers[i]][k].image];
      View view;
      view.lens = static_cast<int>(i);
      view.format = image.format;
      view.width = image.width;
      view.height = image.height;
      view.stride = image.stride();
      view.data = image.data;
      frame.add_view(view);
    }
    out.frames.push_back(std::move(frame));
  }
  return out;
}

}  // namespace lightwell
