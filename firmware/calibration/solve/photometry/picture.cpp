#include "calibration/solve/photometry/picture.hpp"

#include <cmath>
#include <cstring>

namespace lightwell::photometry {
namespace {

Status invalid(const std::string& what) { return {StatusCode::invalid_argument, what}; }

std::string size_text(const Picture& p) { return std::to_string(p.width) + "x" + std::to_string(p.height); }

}  // namespace

Result<Picture> picture_of(const View& view, const std::string& name, int float_levels) {
  const PixelLayout& layout = pixel_layout(view.format);
  if (layout.sampling == ColorSampling::ycbcr)
    return invalid(name + ": " + std::string(to_string(view.format)) +
                   " mixes the values of neighbours; record rgb8 or Bayer for a calibration");
  if (const Status s = check_view(view); !s.ok()) return invalid(name + ": " + s.message());
  Picture out;
  out.pitch = layout.unit_width;
  out.width = view.width / out.pitch;
  out.height = view.height / out.pitch;
  out.levels = layout.is_float() ? float_levels : layout.levels();
  out.rgb.reserve(3 * out.sites());
  const double top = out.levels - 1;
  for (int y = 0; y < out.height; ++y) {
    if (is_bayer(view.format)) {
      for (int x = 0; x < out.width; ++x) {
        out.rgb.push_back(static_cast<float>(code_at(view, 2 * x, 2 * y) / top));
        out.rgb.push_back(static_cast<float>(code_at(view, 2 * x + 1, 2 * y) / top));
        out.rgb.push_back(static_cast<float>(code_at(view, 2 * x + 1, 2 * y + 1) / top));
      }
      continue;
    }
    const std::byte* row = view.data.data() + static_cast<std::size_t>(y) * view.stride;
    for (std::size_t k = 0; k < 3 * static_cast<std::size_t>(out.width); ++k) {
      if (!layout.is_float()) {
        out.rgb.push_back(static_cast<float>(std::to_integer<int>(row[k]) / top));
        continue;
      }
      float v;
      std::memcpy(&v, row + k * sizeof v, sizeof v);
      if (!std::isfinite(v)) return invalid(name + ": a value is not finite; picture values run from 0 to 1");
      out.rgb.push_back(v);
    }
  }
  return out;
}

double rounding_deviation(int levels) { return levels > 1 ? 1 / (std::sqrt(12.0) * (levels - 1)) : 0; }

Status check_alike(std::span<const Picture> pictures, std::size_t least, const std::string& what) {
  if (pictures.size() < least)
    return invalid(what + ": " + std::to_string(pictures.size()) + " pictures, at least " + std::to_string(least) +
                   " are needed; take more");
  for (const Picture& p : pictures) {
    const Picture& first = pictures.front();
    if (p.width != first.width || p.height != first.height || p.pitch != first.pitch || p.levels != first.levels)
      return invalid(what + ": pictures of " + size_text(first) + " with " + std::to_string(first.levels) +
                     " levels and of " + size_text(p) + " with " + std::to_string(p.levels) +
                     "; take all with one camera mode");
    if (p.rgb.size() != 3 * p.sites() || p.sites() == 0) return invalid(what + ": an empty picture");
  }
  return {};
}

}  // namespace lightwell::photometry
