// Reads sensor_msgs/CameraInfo as written by camera_calibration (camera_matrix: {rows, cols, data}) and as the printed
// message (K or k: [...]). Sources: docs.ros.org sensor_msgs/CameraInfo; REP 104 on binning and regions of interest.
#include <algorithm>
#include <array>
#include <cmath>

#include "calibration/solve/import/yaml_map.hpp"

namespace lightwell {

namespace {

constexpr const char* kKnown = "known are equidistant (also called fisheye), plumb_bob, rational_polynomial";

/// A non-negative integer; `absent` if the field is missing.
int whole(const YamlMap& map, const std::string& key, int absent) {
  if (!map.has(key)) return absent;
  const double value = map.number(key);
  if (!(value >= 0 && value <= 65536) || value != std::floor(value))
    map.refuse(key, "must be a whole number from 0 to 65536, it is " + listed(std::array{value}));
  return static_cast<int>(value);
}

/// The numbers of a list, or of a matrix with rows, cols and data.
std::vector<double> matrix(const YamlMap& info, const std::string& key) {
  if (!info.is_map(key)) return info.numbers(key);
  const YamlMap fields = info.map(key);
  const std::vector<double> values = fields.numbers("data");
  const double rows = fields.number("rows"), cols = fields.number("cols");
  if (rows * cols != static_cast<double>(values.size()))
    fields.refuse("data", "has " + std::to_string(values.size()) + " numbers, rows and cols say " +
                              listed(std::array{rows * cols}));
  return values;
}

/// The delivered pictures: a region of interest of the sensor, with binning.
struct Window {
  int x = 0, y = 0, width = 0, height = 0;
  int group_x = 1, group_y = 1;
};

Window window_of(const YamlMap& info, int width, int height) {
  Window w{0, 0, width, height};
  if (info.has("roi")) {
    const YamlMap roi = info.map("roi");
    const int x = whole(roi, "x_offset", 0), y = whole(roi, "y_offset", 0);
    const int cols = whole(roi, "width", 0), rows = whole(roi, "height", 0);
    // By the definition of the message, width = height = 0 is the full picture.
    if (cols != 0 || rows != 0) {
      w = {x, y, cols, rows};
      if (w.width < 1 || w.height < 1 || w.x + w.width > width || w.y + w.height > height)
        info.refuse("roi", "must lie inside the picture of " + std::to_string(width) + " x " + std::to_string(height) +
                               " pixels; all zero is the whole picture");
    } else if (x != 0 || y != 0) {
      info.refuse("roi", "has an offset but no width and height; all zero is the whole picture");
    }
  }
  // By the definition of the message, 0 is the same as 1.
  w.group_x = std::max(1, whole(info, "binning_x", 1));
  w.group_y = std::max(1, whole(info, "binning_y", 1));
  if (w.width % w.group_x != 0 || w.height % w.group_y != 0)
    info.refuse("binning_x", "binning " + std::to_string(w.group_x) + " x " + std::to_string(w.group_y) +
                                 " does not divide the picture of " + std::to_string(w.width) + " x " +
                                 std::to_string(w.height) + " pixels; calibrate with the pictures as they come");
  return w;
}

/// Converts the intrinsics to the pixels of the window. The centre of a binned pixel is the mean of its pixels'
/// centres, so its coordinate 0 is (group - 1) / 2 of the sensor's pixels.
PinholeFields seen_through(const Window& w, const PinholeFields& p) {
  return {p.fx / w.group_x, p.fy / w.group_y, (p.cx - w.x + 0.5) / w.group_x - 0.5,
          (p.cy - w.y + 0.5) / w.group_y - 0.5};
}

}  // namespace

ImportedCameras read_ros_camera_info(std::string_view text, const std::string& name) {
  const YamlMap info = YamlMap::parse(text, name);
  const std::string width_key = info.require({"image_width", "width"});
  const double width = info.number(width_key), height = info.number(info.require({"image_height", "height"}));
  check_size(info, width_key, width, height);
  const Window window = window_of(info, static_cast<int>(width), static_cast<int>(height));
  const std::string k_key = info.require({"camera_matrix", "K", "k"});
  const PinholeFields p = seen_through(window, pinhole_of(info, k_key, matrix(info, k_key)));
  const std::string model = info.word(info.require({"distortion_model"}, std::string("; ") + kKnown));
  const std::string d_key = info.require({"distortion_coefficients", "D", "d"});
  const std::vector<double> d = matrix(info, d_key);
  check_numbers(info, d_key, d);
  const std::string here = "; here are " + std::to_string(d.size());

  ImportedCameras out;
  ImportedCamera& camera = out.cameras.emplace_back();
  camera.name = info.has("camera_name") ? info.word("camera_name") : "camera";
  camera.width = window.width / window.group_x;
  camera.height = window.height / window.group_y;
  if (model == "equidistant" || model == "fisheye") {
    if (d.size() != 4) info.refuse(d_key, model + " has 4 coefficients, k1 k2 k3 k4" + here);
    camera.model = kannala_brandt_of(p, d);
    camera.valid_beyond_90_deg = false;
  } else if (model == "plumb_bob" || model == "rational_polynomial") {
    if (model == "plumb_bob" && d.size() != 4 && d.size() != 5)
      info.refuse(d_key, model + " has 5 coefficients, k1 k2 t1 t2 k3" + here);
    if (model == "rational_polynomial" && d.size() != 8)
      info.refuse(d_key, model + " has 8 coefficients, k1 k2 t1 t2 k3 k4 k5 k6" + here);
    const auto exact = unified_lens(p, 0, d);
    if (!exact)
      info.refuse("distortion_model",
                  no_exact_model(model, "it has more radial terms than k1 and k2 that are not zero"));
    camera.model = *exact;
  } else {
    info.refuse("distortion_model", "'" + model + "' is unknown; " + kKnown);
  }
  if (window.width != static_cast<int>(width) || window.height != static_cast<int>(height))
    out.notes.push_back("roi: the calibration is for pictures of this region alone");
  if (window.group_x != 1 || window.group_y != 1)
    out.notes.push_back("binning: the calibration is for the binned pictures of " + std::to_string(camera.width) +
                        " x " + std::to_string(camera.height) + " pixels");
  return out;
}

}  // namespace lightwell
