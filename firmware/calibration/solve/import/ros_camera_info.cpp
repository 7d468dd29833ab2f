// Reads sensor_msgs/CameraInfo as written by camera_calibration (camera_matrix: {rows, cols, data}) and as the printed
// message (K or k: [...]). Sources: docs.ros.org sensor_msgs/CameraInfo; REP 104 on binning and regions of interest.
#include <array>
#include <cmath>

#include "calibration/solve/import/camera_fields.hpp"
#include "calibration/solve/import/readers.hpp"
#include "calibration/solve/import/yaml_map.hpp"

namespace lightwell {

namespace {

constexpr const char* kKnown = "known are equidistant (also called fisheye), plumb_bob, rational_polynomial";

/// A non-negative integer; `absent` if the field is missing.
Result<int> whole(const YamlMap& map, const std::string& key, int absent) {
  if (!map.has(key)) return absent;
  const Result<double> value = map.number(key);
  if (!value) return value.status();
  if (!(*value >= 0 && *value <= 65536) || *value != std::floor(*value))
    return map.problem(key, "must be a whole number from 0 to 65536, it is " + listed(std::array{*value}));
  return static_cast<int>(*value);
}

/// The numbers of one of `keys`, a list or a matrix with rows, cols and data.
struct Numbers {
  std::string key;
  std::vector<double> values;
};

Result<Numbers> matrix(const YamlMap& info, const std::vector<std::string>& keys) {
  const Result<std::string> key = info.one_of(keys);
  if (!key) return key.status();
  if (key->empty()) return info.problem(keys.front(), "is missing");
  if (!info.is_map(*key)) {
    Result<std::vector<double>> values = info.numbers(*key);
    if (!values) return values.status();
    return Numbers{*key, std::move(*values)};
  }
  const Result<YamlMap> fields = info.map(*key);
  if (!fields) return fields.status();
  Result<std::vector<double>> values = fields->numbers("data");
  if (!values) return values.status();
  const Result<double> rows = fields->number("rows"), cols = fields->number("cols");
  if (!rows) return rows.status();
  if (!cols) return cols.status();
  if (*rows * *cols != static_cast<double>(values->size()))
    return fields->problem("data", "has " + std::to_string(values->size()) + " numbers, rows and cols say " +
                                       listed(std::array{*rows * *cols}));
  return Numbers{*key, std::move(*values)};
}

/// Width or height of the full picture of the sensor.
Result<double> side(const YamlMap& info, const std::string& written, const std::string& message) {
  const Result<std::string> key = info.one_of({written, message});
  if (!key) return key.status();
  return info.number(key->empty() ? written : *key);
}

/// The delivered pictures: a region of interest of the sensor, with binning.
struct Window {
  int x = 0, y = 0, width = 0, height = 0;
  int group_x = 1, group_y = 1;
};

Result<Window> window_of(const YamlMap& info, int width, int height) {
  Window w{0, 0, width, height, 1, 1};
  if (info.has("roi")) {
    const Result<YamlMap> roi = info.map("roi");
    if (!roi) return roi.status();
    const Result<int> x = whole(*roi, "x_offset", 0), y = whole(*roi, "y_offset", 0);
    const Result<int> cols = whole(*roi, "width", 0), rows = whole(*roi, "height", 0);
    for (const Result<int>* r : {&x, &y, &cols, &rows})
      if (!*r) return r->status();
    // By the definition of the message, width = height = 0 is the full picture.
    if (*cols != 0 || *rows != 0) {
      w.x = *x, w.y = *y, w.width = *cols, w.height = *rows;
      if (w.width < 1 || w.height < 1 || w.x + w.width > width || w.y + w.height > height)
        return info.problem("roi", "must lie inside the picture of " + std::to_string(width) + " x " +
                                       std::to_string(height) + " pixels; all zero is the whole picture");
    } else if (*x != 0 || *y != 0) {
      return info.problem("roi", "has an offset but no width and height; all zero is the whole picture");
    }
  }
  const Result<int> bx = whole(info, "binning_x", 1), by = whole(info, "binning_y", 1);
  if (!bx) return bx.status();
  if (!by) return by.status();
  // By the definition of the message, 0 is the same as 1.
  w.group_x = *bx == 0 ? 1 : *bx;
  w.group_y = *by == 0 ? 1 : *by;
  if (w.width % w.group_x != 0 || w.height % w.group_y != 0)
    return info.problem("binning_x", "binning " + std::to_string(w.group_x) + " x " + std::to_string(w.group_y) +
                                         " does not divide the picture of " + std::to_string(w.width) + " x " +
                                         std::to_string(w.height) +
                                         " pixels; calibrate with the pictures as they come");
  return w;
}

/// Converts the intrinsics to the pixels of the window. The centre of a binned pixel is the mean of its pixels'
/// centres, so its coordinate 0 is (group - 1) / 2 of the sensor's pixels.
PinholeFields seen_through(const Window& w, const PinholeFields& p) {
  return {p.fx / w.group_x, p.fy / w.group_y, (p.cx - w.x + 0.5) / w.group_x - 0.5,
          (p.cy - w.y + 0.5) / w.group_y - 0.5};
}

}  // namespace

Result<ImportedCameras> read_ros_camera_info(std::string_view text, const std::string& name) {
  const Result<YamlMap> info = YamlMap::parse(text, name);
  if (!info) return info.status();
  const Result<double> width = side(*info, "image_width", "width"), height = side(*info, "image_height", "height");
  if (!width) return width.status();
  if (!height) return height.status();
  if (std::string s = size_problem(*width, *height); !s.empty())
    return info->problem(info->has("image_width") ? "image_width" : "width", s);
  const Result<Window> window = window_of(*info, static_cast<int>(*width), static_cast<int>(*height));
  if (!window) return window.status();

  const Result<Numbers> k = matrix(*info, {"camera_matrix", "K", "k"});
  if (!k) return k.status();
  if (std::string s = camera_matrix_problem(k->values); !s.empty()) return info->problem(k->key, s);
  const PinholeFields p = seen_through(*window, pinhole_of(k->values));

  const Result<std::string> model = info->word("distortion_model");
  if (!model) return Status(model.status().code(), model.status().message() + "; " + kKnown);
  const Result<Numbers> d = matrix(*info, {"distortion_coefficients", "D", "d"});
  if (!d) return d.status();
  if (std::string s = numbers_problem(d->values); !s.empty()) return info->problem(d->key, s);
  const std::size_t count = d->values.size();

  ImportedCameras out;
  ImportedCamera& camera = out.cameras.emplace_back();
  camera.name = "camera";
  if (info->has("camera_name")) {
    const Result<std::string> word = info->word("camera_name");
    if (!word) return word.status();
    camera.name = *word;
  }
  camera.width = window->width / window->group_x;
  camera.height = window->height / window->group_y;
  if (*model == "equidistant" || *model == "fisheye") {
    if (count != 4)
      return info->problem(d->key, *model + " has 4 coefficients, k1 k2 k3 k4; here are " + std::to_string(count));
    camera.model = kannala_brandt_of(p, d->values);
    camera.valid_beyond_90_deg = false;
  } else if (*model == "plumb_bob" || *model == "rational_polynomial") {
    const bool plumb = *model == "plumb_bob";
    if (plumb ? count != 4 && count != 5 : count != 8)
      return info->problem(d->key, *model +
                                       (plumb ? " has 5 coefficients, k1 k2 t1 t2 k3; here are "
                                              : " has 8 coefficients, k1 k2 t1 t2 k3 k4 k5 k6; here are ") +
                                       std::to_string(count));
    const auto exact = unified_lens(p, 0, d->values);
    if (!exact)
      return info->problem("distortion_model",
                           no_exact_model(*model, "it has more radial terms than k1 and k2 that are not zero"));
    camera.model = *exact;
  } else {
    return info->problem("distortion_model", "'" + *model + "' is unknown; " + kKnown);
  }
  if (window->width != static_cast<int>(*width) || window->height != static_cast<int>(*height))
    out.notes.push_back("roi: the calibration is for pictures of this region alone");
  if (window->group_x != 1 || window->group_y != 1)
    out.notes.push_back("binning: the calibration is for the binned pictures of " + std::to_string(camera.width) +
                        " x " + std::to_string(camera.height) + " pixels");
  return out;
}

}  // namespace lightwell
