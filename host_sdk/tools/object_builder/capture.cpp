#include "capture.hpp"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <numbers>
#include <optional>
#include <span>

#include <nlohmann/json.hpp>
#include <opencv2/imgcodecs.hpp>

#include <lightwell/bytes.hpp>
#include <lightwell/files.hpp>
#include <lightwell/pixel.hpp>

namespace lightwell::tool {
namespace {

using Json = nlohmann::json;

constexpr const char* kFields[] = {"turns_deg",
                                   "light_positions_m",
                                   "camera_distance_m",
                                   "half_width_m",
                                   "reference_irradiance",
                                   "pictures",
                                   "coverage",
                                   "ambient"};

Status wrong(const std::string& field, const std::string& rule) {
  return invalid_argument("object.json: \"" + field + "\" must be " + rule);
}

Status read_number(const Json& json, const char* field, std::optional<float> missing, float& out) {
  if (!json.contains(field) && missing) {
    out = *missing;
    return {};
  }
  if (!json.contains(field) || !json[field].is_number()) return wrong(field, "a number");
  out = json[field].get<float>();
  return {};
}

/// A name inside of the folder.
Status read_pattern(const Json& json, const char* field, std::string& out) {
  if (!json.contains(field) || !json[field].is_string()) return wrong(field, "the name of files, with {view}");
  out = json[field].get<std::string>();
  const std::filesystem::path path = path_of(out);
  for (const auto& part : path)
    if (part == "..") return wrong(field, "a name inside of the folder");
  if (path.is_absolute()) return wrong(field, "a name inside of the folder");
  return {};
}

Status read_rig(const Json& json, ObjectRig& rig) {
  if (!json.contains("turns_deg") || !json["turns_deg"].is_array()) return wrong("turns_deg", "a list of numbers");
  for (const Json& turn : json["turns_deg"]) {
    if (!turn.is_number()) return wrong("turns_deg", "a list of numbers");
    rig.turns_rad.push_back(static_cast<float>(turn.get<double>() * std::numbers::pi / 180));
  }
  const char* const positions = "light_positions_m";
  if (!json.contains(positions) || !json[positions].is_array()) return wrong(positions, "a list of [x, y, z]");
  for (const Json& p : json[positions]) {
    if (!p.is_array() || p.size() != 3 || !p[0].is_number() || !p[1].is_number() || !p[2].is_number())
      return wrong(positions, "a list of [x, y, z]");
    rig.light_positions.push_back({p[0].get<float>(), p[1].get<float>(), p[2].get<float>()});
  }
  if (const Status read = read_number(json, "camera_distance_m", std::nullopt, rig.camera_distance_m); !read.ok())
    return read;
  if (const Status read = read_number(json, "half_width_m", std::nullopt, rig.half_width_m); !read.ok()) return read;
  if (const Status read = read_number(json, "reference_irradiance", 1.0F, rig.reference_irradiance); !read.ok())
    return read;
  // The size is not known yet.
  ObjectRig sized = rig;
  sized.columns = sized.rows = 1;
  return sized.validate().in("object.json");
}

Result<cv::Mat> read_picture(const std::string& path, int mode) {
  cv::Mat image;
  try {
    image = cv::imread(path, mode);
  } catch (const cv::Exception&) {
    image = cv::Mat();
  }
  if (image.empty()) return Status(StatusCode::data_loss, path + ": this is no PNG or JPEG picture, or it is damaged");
  if (image.depth() != CV_8U && image.depth() != CV_16U)
    return invalid_argument(path + ": pictures must have 8 or 16 bits in each channel");
  return image;
}

Status check_size(const std::string& path, const cv::Mat& image, const ObjectRig& rig) {
  if (image.cols == rig.columns && image.rows == rig.rows) return {};
  return invalid_argument(path + " has " + std::to_string(image.cols) + " x " + std::to_string(image.rows) +
                          " pixels, the first picture " + std::to_string(rig.columns) + " x " +
                          std::to_string(rig.rows) + ": make all of the same size");
}

Status read_linear(const std::string& path, const ObjectRig& rig, std::vector<Radiance>& out) {
  const auto image = read_picture(path, cv::IMREAD_COLOR | cv::IMREAD_ANYDEPTH);
  if (!image.ok()) return image.status();
  if (const Status size = check_size(path, *image, rig); !size.ok()) return size;
  const bool wide = image->depth() == CV_16U;
  std::vector<float> linear(wide ? 65536 : 256);
  for (std::size_t i = 0; i < linear.size(); ++i)
    linear[i] = static_cast<float>(srgb_to_linear(static_cast<double>(i) / static_cast<double>(linear.size() - 1)));
  out.clear();
  for (int row = 0; row < image->rows; ++row)
    for (int column = 0; column < image->cols; ++column) {
      // OpenCV's order is blue, green, red.
      const auto value = [&](int channel) {
        return linear[wide ? image->at<cv::Vec3w>(row, column)[channel] : image->at<cv::Vec3b>(row, column)[channel]];
      };
      out.push_back({value(2), value(1), value(0)});
    }
  return {};
}

}  // namespace

std::string file_name(std::string pattern, std::size_t view, std::size_t light) {
  for (const auto& [name, number] : {std::pair{std::string("{view}"), view}, {std::string("{light}"), light}})
    for (std::size_t at = pattern.find(name); at != std::string::npos; at = pattern.find(name))
      pattern.replace(at, name.size(), std::to_string(number));
  return pattern;
}

Result<std::array<int, 2>> picture_size(const std::string& path) {
  const auto picture = read_picture(path, cv::IMREAD_COLOR | cv::IMREAD_ANYDEPTH);
  if (!picture.ok()) return picture.status();
  return std::array<int, 2>{picture->cols, picture->rows};
}

Result<Capture> read_capture(const std::string& folder) {
  const std::string path = folder + "/object.json";
  const auto text = read_named_file(path);
  if (!text.ok()) return text.status();
  if (!text->has_value())
    return Status(StatusCode::not_found,
                  path + " does not exist: describe the capture in it (lightwell-object --help)");
  const Json json = Json::parse(**text, nullptr, false);
  if (!json.is_object()) return invalid_argument(path + " is no JSON object");
  for (const auto& [name, value] : json.items())
    if (std::find(std::begin(kFields), std::end(kFields), name) == std::end(kFields))
      return invalid_argument("object.json: there is no field \"" + name + "\"");
  Capture out;
  if (const Status read = read_rig(json, out.rig); !read.ok()) return read;
  std::string pictures, coverage, ambient;
  if (const Status read = read_pattern(json, "pictures", pictures); !read.ok()) return read;
  if (const Status read = read_pattern(json, "coverage", coverage); !read.ok()) return read;
  if (json.contains("ambient"))
    if (const Status read = read_pattern(json, "ambient", ambient); !read.ok()) return read;
  if (pictures.find("{light}") == std::string::npos)
    return wrong("pictures", "the name of files, with {view} and {light}");
  for (std::size_t v = 0; v < out.rig.turns_rad.size(); ++v) {
    Capture::View view;
    for (std::size_t l = 0; l < out.rig.light_positions.size(); ++l)
      view.lit.push_back(folder + "/" + file_name(pictures, v, l));
    view.coverage = folder + "/" + file_name(coverage, v, 0);
    if (!ambient.empty()) view.ambient = folder + "/" + file_name(ambient, v, 0);
    out.views.push_back(std::move(view));
  }
  return out;
}

std::vector<std::string> missing_pictures(const Capture& capture) {
  std::vector<std::string> out;
  const auto check = [&](const std::string& path) {
    std::error_code error;
    if (!path.empty() && !std::filesystem::is_regular_file(path_of(path), error)) out.push_back(path);
  };
  for (const Capture::View& view : capture.views) {
    for (const std::string& path : view.lit) check(path);
    check(view.coverage);
    check(view.ambient);
  }
  return out;
}

Status find_size(Capture& capture) {
  const auto size = picture_size(capture.views[0].lit[0]);
  if (!size.ok()) return size.status();
  capture.rig.columns = (*size)[0];
  capture.rig.rows = (*size)[1];
  return capture.rig.validate().in(capture.views[0].lit[0]);
}

Result<std::string> fingerprint(const Capture& capture, std::size_t view, const ObjectEncoderOptions& options) {
  std::uint32_t crc = 0;
  const auto add = [&](std::string_view bytes) { crc = crc32c(std::as_bytes(std::span(bytes)), crc); };
  for (const float number : {options.luminance_step, options.highlight_step, options.base_step,
                             capture.rig.reference_irradiance, capture.rig.turns_rad[view]})
    add(std::to_string(number));
  for (const Vec3f& p : capture.rig.light_positions)
    add(std::to_string(p.x) + " " + std::to_string(p.y) + " " + std::to_string(p.z));
  std::vector<std::string> paths = capture.views[view].lit;
  paths.push_back(capture.views[view].coverage);
  if (!capture.views[view].ambient.empty()) paths.push_back(capture.views[view].ambient);
  for (const std::string& path : paths) {
    const auto bytes = read_text_file(path);
    if (!bytes.ok()) return bytes.status();
    add(*bytes);
  }
  return std::to_string(crc);
}

Result<std::string> build_view(const Capture& capture, std::size_t view, const ObjectEncoderOptions& options) {
  const Capture::View& files = capture.views[view];
  std::vector<std::vector<Radiance>> lit(files.lit.size());
  std::vector<Radiance> ambient;
  ViewPictures pictures;
  for (std::size_t i = 0; i < lit.size(); ++i) {
    if (const Status read = read_linear(files.lit[i], capture.rig, lit[i]); !read.ok()) return read;
    pictures.lit.emplace_back(lit[i]);
  }
  if (!files.ambient.empty()) {
    if (const Status read = read_linear(files.ambient, capture.rig, ambient); !read.ok()) return read;
    pictures.ambient = ambient;
  }
  const auto coverage = read_picture(files.coverage, cv::IMREAD_GRAYSCALE);
  if (!coverage.ok()) return coverage.status();
  if (const Status size = check_size(files.coverage, *coverage, capture.rig); !size.ok()) return size;
  std::vector<std::uint8_t> shares;
  for (int row = 0; row < coverage->rows; ++row)
    shares.insert(shares.end(), coverage->ptr<std::uint8_t>(row), coverage->ptr<std::uint8_t>(row) + coverage->cols);
  pictures.coverage = shares;
  return encode_view(capture.rig, pictures, options);
}

}  // namespace lightwell::tool
