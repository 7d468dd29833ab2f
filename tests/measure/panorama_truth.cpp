#include "measure/panorama_truth.hpp"

#include <array>
#include <cstring>
#include <filesystem>
#include <string_view>
#include <system_error>
#include <utility>

#include "imaging/image_file.hpp"
#include "sim/panorama.hpp"

namespace lightwell::measure {

namespace ref = reference;

namespace {

constexpr std::array<std::string_view, 8> kBlender = {"city",  "courtyard", "forest",  "interior",
                                                      "night", "studio",    "sunrise", "sunset"};
constexpr std::array<std::string_view, 18> kPmndrs = {
    "apartment", "bridge", "city", "dawn",   "esplanade", "forest", "hall",   "lab",       "lobby",
    "night",     "park",   "sky",  "studio", "sunrise",   "sunset", "venice", "warehouse", "workshop"};

}  // namespace

const std::vector<ref::V3>& truth_normals() {
  static const std::vector<ref::V3> normals = ref::fibonacci_normals(2048);
  return normals;
}

PanoramaTruth panorama_truth(std::string name, const ref::Panorama& panorama) {
  PanoramaTruth truth{std::move(name), PanoramaSums(ref::cleaned(panorama)), {}, {}};
  for (const ref::V3& n : truth_normals()) truth.irradiance.push_back(truth.sums.irradiance(n));
  truth.brightest = ref::bright_region(truth.sums.panorama());
  return truth;
}

Result<PanoramaTruth> load_panorama_truth(const std::string& path) {
  const Result<Image> image = read_image(path);
  if (!image) return image.status();
  if (image->format != PixelFormat::rgb_f32 || image->height < 1 || image->width != 2 * image->height)
    return Status(StatusCode::invalid_argument,
                  path +
                      ": a panorama holds radiance over the whole sphere; use an OpenEXR or Radiance HDR file that is "
                      "twice as wide as it is high");
  std::vector<float> rgb(image->data.size() / sizeof(float));
  std::memcpy(rgb.data(), image->data.data(), rgb.size() * sizeof(float));
  return panorama_truth(std::filesystem::path(path).stem().string(),
                        {image->width, image->height, {rgb.begin(), rgb.end()}});
}

ref::IrradianceError irradiance_error(const PanoramaTruth& truth, const IrradianceAnswer& answer) {
  std::vector<ref::Rgb> got;
  for (const ref::V3& n : truth_normals()) got.push_back(answer(n));
  return ref::irradiance_error(truth.irradiance, got);
}

Result<std::vector<std::string>> eight_panoramas() {
  std::vector<std::string> paths;
  for (const std::string_view name : kBlender) {
    Result<std::string> path = sim::scene_path(name);
    if (!path) return path.status();
    paths.push_back(std::move(*path));
  }
  return paths;
}

Result<std::vector<std::string>> all_panoramas() {
  Result<std::vector<std::string>> paths = eight_panoramas();
  if (!paths) return paths;
  const std::filesystem::path folder = std::filesystem::path(paths->front()).parent_path();
  for (const std::string_view name : kPmndrs) {
    const std::filesystem::path path = folder / ("pmndrs_" + std::string(name) + ".exr");
    std::error_code error;
    if (!std::filesystem::exists(path, error))
      return Status(StatusCode::not_found,
                    "the panorama " + path.string() + " does not exist: run cmake/fetch_panoramas --all");
    paths->push_back(path.string());
  }
  return paths;
}

}  // namespace lightwell::measure
