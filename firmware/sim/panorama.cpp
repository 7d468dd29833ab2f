#include "sim/panorama.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <numbers>
#include <system_error>
#include <utility>

#include <lightwell/equirect.hpp>
#include <lightwell/text.hpp>

#include "imaging/image_file.hpp"
#include "imaging/uri.hpp"

namespace lightwell::sim {

namespace {

constexpr double kTwoTo32 = 4294967296.0;

constexpr std::array<std::string_view, 8> kScenes = {"city",  "courtyard", "forest",  "interior",
                                                     "night", "studio",    "sunrise", "sunset"};

/// Value of an environment variable; empty if unset.
std::string environment(const char* name) {
  const char* value = std::getenv(name);
  return value == nullptr ? "" : value;
}

/// The folder of cmake/fetch_panoramas; empty if there is no home directory.
std::filesystem::path panorama_folder() {
  if (const std::string folder = environment("LIGHTWELL_PANORAMA_DIR"); !folder.empty()) return folder;
  std::filesystem::path cache = environment("LIGHTWELL_CACHE");
  if (cache.empty()) {
    std::filesystem::path base = environment("XDG_CACHE_HOME");
    if (base.empty() && !environment("HOME").empty()) base = std::filesystem::path(environment("HOME")) / ".cache";
    if (base.empty()) return {};
    cache = base / "lightwell";
  }
  return cache / "panoramas";
}

std::size_t index_of(const Panorama& p, int i, int j) {
  return 3 * (static_cast<std::size_t>(j) * static_cast<std::size_t>(p.width) + static_cast<std::size_t>(i));
}

/// A pixel whose row may be one beyond a pole: that is the pole's own row on the opposite meridian.
Radiance neighbour(const Panorama& p, int i, int j) {
  if (j < 0) return p.pixel(i + p.width / 2, -1 - j);
  if (j >= p.height) return p.pixel(i + p.width / 2, 2 * p.height - 1 - j);
  return p.pixel(i, j);
}

}  // namespace

SpherePoint sphere_point(Vec3d direction) {
  const EquirectUv uv = equirect_uv(direction);
  const double u = std::floor(uv.u * kTwoTo32 + 0.5);
  const double v = std::clamp(std::floor(uv.v * kTwoTo32 + 0.5), 0.0, kTwoTo32 - 1);
  return {static_cast<std::uint32_t>(static_cast<std::uint64_t>(u)), static_cast<std::uint32_t>(v)};
}

Radiance Panorama::pixel(int i, int j) const {
  const int column = i < 0 ? i + width : i < width ? i : i - width;
  const float* at = rgb.data() + index_of(*this, column, j);
  return {at[0], at[1], at[2]};
}

Radiance Panorama::radiance(SpherePoint point) const {
  const double x = static_cast<double>(point.u) / kTwoTo32 * width - 0.5;
  const double y = static_cast<double>(point.v) / kTwoTo32 * height - 0.5;
  // floor(): both are above -1, so truncation after adding 1 rounds down.
  const int i = static_cast<int>(x + 1) - 1, j = static_cast<int>(y + 1) - 1;
  const auto fx = static_cast<float>(x - i), fy = static_cast<float>(y - j);
  const Radiance above = neighbour(*this, i, j) * (1 - fx) + neighbour(*this, i + 1, j) * fx;
  const Radiance below = neighbour(*this, i, j + 1) * (1 - fx) + neighbour(*this, i + 1, j + 1) * fx;
  return above * (1 - fy) + below * fy;
}

Result<Panorama> make_panorama(int width, int height, std::vector<float> rgb) {
  if (height < 2 || width != 2 * height)
    return invalid_argument("a panorama must be twice as wide as it is high, this picture is " +
                            formatted("%dx%d", width, height) +
                            ": stretch or pad it to 2:1 (the whole sphere, equirectangular)");
  if (rgb.size() != 3 * static_cast<std::size_t>(width) * static_cast<std::size_t>(height))
    return invalid_argument("a panorama needs three floats a pixel");

  Panorama p{width, height, std::move(rgb), {}};
  float largest = 0;
  for (const float x : p.rgb)
    if (std::isfinite(x)) largest = std::max(largest, x);
  for (float& x : p.rgb) {
    if (std::isnan(x)) {
      ++p.sanitize_counts.nan;
      x = 0;
    } else if (x < 0) {
      ++p.sanitize_counts.negative;
      x = 0;
    } else if (std::isinf(x)) {
      ++p.sanitize_counts.infinite;
      x = largest;
    }
  }
  return p;
}

Result<Panorama> load_panorama(const std::string& path) {
  const Result<Image> image = read_image(path);
  if (!image) return image.status();
  if (image->format != PixelFormat::rgb_f32)
    return invalid_argument(path + ": 8-bit pictures hold no radiance; use an OpenEXR or Radiance HDR file");
  std::vector<float> rgb(image->data.size() / sizeof(float));
  std::memcpy(rgb.data(), image->data.data(), rgb.size() * sizeof(float));
  Result<Panorama> panorama = make_panorama(image->width, image->height, std::move(rgb));
  if (!panorama) return Status(panorama.status().code(), path + ": " + panorama.status().message());
  return panorama;
}

Panorama from_function(int width, const std::function<Radiance(Vec3d)>& f) {
  Panorama p;
  p.width = width;
  p.height = width / 2;
  p.rgb.reserve(3 * static_cast<std::size_t>(p.width) * static_cast<std::size_t>(p.height));
  for (int j = 0; j < p.height; ++j) {
    for (int i = 0; i < p.width; ++i) {
      const Radiance l = f(equirect_direction((i + 0.5) / p.width, (j + 0.5) / p.height));
      p.rgb.insert(p.rgb.end(), {l.r, l.g, l.b});
    }
  }
  return p;
}

double mean_luminance(const Panorama& panorama) {
  double sum = 0;
  for (int j = 0; j < panorama.height; ++j) {
    double row = 0;
    for (int i = 0; i < panorama.width; ++i) row += static_cast<double>(panorama.pixel(i, j).luminance());
    sum += row * equirect_solid_angle(j, panorama.width, panorama.height);
  }
  return sum / (4 * std::numbers::pi);
}

double luminance_percentile(const Panorama& panorama, double share) {
  std::vector<std::pair<double, double>> patches;  // luminance, solid angle
  patches.reserve(panorama.rgb.size() / 3);
  double sphere = 0;
  for (int j = 0; j < panorama.height; ++j) {
    const double omega = equirect_solid_angle(j, panorama.width, panorama.height);
    for (int i = 0; i < panorama.width; ++i) {
      patches.emplace_back(panorama.pixel(i, j).luminance(), omega);
      sphere += omega;
    }
  }
  std::sort(patches.begin(), patches.end());
  double below = 0;
  for (const auto& [luminance, omega] : patches) {
    below += omega;
    if (below >= share * sphere) return luminance;
  }
  return patches.empty() ? 0 : patches.back().first;
}

Result<std::string> scene_path(std::string_view name_or_path) {
  if (name_or_path.ends_with(".exr") || name_or_path.ends_with(".hdr")) return std::string(name_or_path);

  const std::vector<std::string_view> known(kScenes.begin(), kScenes.end());
  const std::string name(name_or_path);
  if (std::find(known.begin(), known.end(), name_or_path) == known.end()) {
    const std::string near = nearest_name(name_or_path, known);
    return invalid_argument("no scene is called '" + name + "'" +
                            (near.empty() ? "" : ", did you mean '" + near + "'?") + " Known: " + joined(kScenes) +
                            ", or a path that ends in .exr or .hdr");
  }
  const std::filesystem::path file = panorama_folder() / (name + ".exr");
  std::error_code error;
  if (!std::filesystem::exists(file, error)) {
    return Status(StatusCode::not_found,
                  "the panorama " + file.string() +
                      " is not there: run cmake/fetch_panoramas, or set LIGHTWELL_PANORAMA_DIR to the "
                      "folder that holds it");
  }
  return file.string();
}

HighlightMask::HighlightMask(const Panorama& panorama)
    : width_(static_cast<std::uint64_t>(panorama.width)),
      height_(static_cast<std::uint64_t>(panorama.height)),
      mask_(width_ * height_, 0) {
  constexpr double kTimesMean = 50;
  const auto threshold = static_cast<float>(kTimesMean * mean_luminance(panorama));
  const int width = panorama.width;
  for (int j = 0; j < panorama.height; ++j) {
    for (int i = 0; i < width; ++i) {
      if (!(panorama.pixel(i, j).luminance() > threshold)) continue;
      for (int row = std::max(j - 1, 0); row <= std::min(j + 1, panorama.height - 1); ++row)
        for (const int column : {(i + width - 1) % width, i, (i + 1) % width})
          mask_[static_cast<std::size_t>(row * width + column)] = 1;
    }
  }
}

}  // namespace lightwell::sim
